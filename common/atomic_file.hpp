// common/atomic_file.hpp
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace ellicast::common {

/// Why a file could not be written; one line, without the path.
class WriteFailure : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// Writes the bytes to a temporary file beside `path` and renames it, so that a reader sees the old
/// file or the new one, never half of one; on failure the old one stays and no temporary is left. A
/// symbolic link is followed; what is neither a regular file nor missing (a pipe, a device) is
/// written to directly. Throws WriteFailure.
void write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace ellicast::common
