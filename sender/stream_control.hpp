#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/rate_meter.hpp"
#include "common/service_notification.hpp"
#include "sender/model_watch.hpp"
#include "sender/options.hpp"
#include "sender/session.hpp"
#include "sender/status.hpp"
#include "sender/udp_endpoint.hpp"

namespace ellicast::sender {

/// What goes on beside a running session, a few times a second and without ever waiting: changed
/// models become new versions of their pages, the status file is kept, the service manager told.
class StreamControl {
  public:
    /// Refers to the session, the endpoint and the watch, which may be null.
    StreamControl(const Options& options, Session& session, const UdpEndpoint& endpoint,
                  std::vector<LoadedModel> models, ModelWatch* watch);

    void begin(Time now);
    void on_tick(Time now);
    /// All models are to be read again.
    void on_hangup();
    void end(Time now);

    /// Of the versions on air, by page; those replaced are gone.
    [[nodiscard]] const std::vector<LoadedModel>& models() const { return models_; }

  private:
    void look_for_changes();
    void take_changes();
    void write_status(Time now, const char* state);

    const Options& options_;
    Session& session_;
    const UdpEndpoint& endpoint_;
    ModelWatch* watch_;
    std::vector<LoadedModel> models_;
    std::map<std::size_t, LoadedModel> waiting_;  // by page, until its version is on air
    std::vector<std::uint32_t> versions_;
    std::uint32_t rounds_looked_after_ = 0;
    common::ServiceNotification notification_{UdpEndpoint::tell_local};
    common::RateMeter rate_;
    Time begun_{};
    Time next_status_{};
    bool stopping_ = false;
    bool complained_ = false;
};

}  // namespace ellicast::sender
