#include "sender/stream_control.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "common/atomic_file.hpp"

namespace ellicast::sender {
namespace {

constexpr Time kStatusInterval = std::chrono::seconds(1);

}  // namespace

StreamControl::StreamControl(const Options& options, Session& session, const UdpEndpoint& endpoint,
                             std::vector<LoadedModel> models, ModelWatch* watch)
    : options_(options),
      session_(session),
      endpoint_(endpoint),
      watch_(watch),
      models_(std::move(models)),
      versions_(session.versions()) {}

void StreamControl::begin(Time now) {
    begun_ = next_status_ = now;
    notification_.ready(fmt::format("sending {} to {}",
                                    models_.size() == 1
                                        ? session_.plans()[0].object().description.name
                                        : fmt::format("{} pages", models_.size()),
                                    endpoint_.peer()));
    write_status(now, "sending");
}

void StreamControl::on_tick(Time now) {
    if (watch_) {
        look_for_changes();
        take_changes();
    }
    if (session_.finishing() && !stopping_) {
        stopping_ = true;
        spdlog::info("ending with round {}", session_.round());
        notification_.stopping();
    }
    if (now >= next_status_) {
        next_status_ = now + kStatusInterval;
        write_status(now, stopping_ ? "stopping" : "sending");
    }
    notification_.alive_when_due(now);
}

void StreamControl::on_hangup() {
    spdlog::info("reading all models again");
    if (watch_) watch_->check(true);
}

void StreamControl::end(Time now) {
    if (watch_) take_changes();
    if (!stopping_) notification_.stopping();
    write_status(now, "ended");
}

void StreamControl::look_for_changes() {
    if (session_.counts().rounds == rounds_looked_after_) return;
    rounds_looked_after_ = session_.counts().rounds;
    watch_->check(false);
}

void StreamControl::take_changes() {
    for (FreshPage& fresh : watch_->take()) {
        waiting_.insert_or_assign(fresh.page, std::move(fresh.model));
        session_.replace(fresh.page, std::move(fresh.plan));
    }
    for (std::size_t page = 0; page < versions_.size(); ++page) {
        if (session_.versions()[page] == versions_[page]) continue;
        versions_[page] = session_.versions()[page];
        spdlog::info("{}: version {} is on air from round {} on", models_[page].path.string(),
                     versions_[page], session_.first_round(page));
        const auto model = waiting_.find(page);
        if (model == waiting_.end()) continue;
        models_[page] = std::move(model->second);
        waiting_.erase(model);
    }
    if (auto retired = session_.take_retired(); !retired.empty()) {
        watch_->discard(std::move(retired));
    }
}

void StreamControl::write_status(Time now, const char* state) {
    if (!options_.status) return;
    const EndpointCounts& counts = endpoint_.counts();
    const std::uint64_t bytes = counts.bytes + counts.sent * endpoint_.ip_udp_bytes();
    rate_.add(now, 8 * bytes);
    try {
        common::write_file_atomically(
            *options_.status, status_json({state, endpoint_.peer(), now - begun_,
                                           options_.bits_per_second, rate_.bits_per_second()},
                                          session_, counts));
    } catch (const common::WriteFailure& failure) {
        if (!complained_) spdlog::warn("{}: {}", options_.status->string(), failure.what());
        complained_ = true;
    }
}

}  // namespace ellicast::sender
