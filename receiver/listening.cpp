#include "receiver/listening.hpp"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

namespace ellicast::receiver {
namespace {

/// Throws ListenError. A little more than a description may have is enough to refuse it.
std::string read_text(const std::filesystem::path& path) {
    std::error_code error;
    const bool directory = std::filesystem::is_directory(path, error);
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (directory || !file) {
        const int reason = directory ? EISDIR : errno;
        throw ListenError("--sdp " + path.string() + ": " +
                          std::generic_category().message(reason));
    }
    std::string text(protocol::kMaxSessionDescriptionBytes + 1, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(file.gcount()));
    return text;
}

protocol::SessionDescription read_description(const std::filesystem::path& path) {
    const std::string text = read_text(path);
    try {
        return protocol::parse_session_description(text);
    } catch (const protocol::SessionDescriptionError& error) {
        throw ListenError("--sdp " + path.string() + ": " + error.what());
    }
}

}  // namespace

ListenOptions listen_options_of(const protocol::SessionDescription& description,
                                const std::string& interface) {
    ListenOptions where;
    where.listen.port = description.port;
    where.interface = interface;
    if (description.to_group()) {
        where.listen.host = description.address;
        where.source = description.source;
    }
    return where;
}

Listening listening_of(const Options& options) {
    if (!options.sdp) return {{options.listen, options.interface, options.source}, {}, {}};
    const protocol::SessionDescription description = read_description(*options.sdp);
    return {listen_options_of(description, options.interface), description.payload_type,
            description};
}

void log_key_hints(const protocol::SessionDescription& description, const Options& options) {
    if (description.sealed && !options.trust.psk) {
        spdlog::warn("the description says that the stream is sealed: --psk is needed");
    }
    if (!description.public_key.empty() && options.trust.verify.empty()) {
        spdlog::warn("the description names a key; where its file can be trusted, --verify {}",
                     description.public_key);
    }
}

}  // namespace ellicast::receiver
