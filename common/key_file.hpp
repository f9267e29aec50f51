// common/key_file.hpp: keys as files, one line of hexadecimal digits each.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "common/secure_datagram.hpp"

namespace ellicast::common {

/// One line that names the file and what is wrong with it.
class KeyError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// 64 hex digits, or the name of a file that holds them: the key as `write_signing_key` leaves it
/// beside the private one. Throws KeyError; so it does for the names of private keys.
PublicKey read_public_key(const std::string& text);

/// 128 hex digits (seed and public key), which must belong together. Refused when others than owner
/// and group can read the file. Throws KeyError.
SigningKey read_signing_key(const std::filesystem::path& path);

/// 64 hex digits; refused as above. Throws KeyError.
SharedKey read_shared_key(const std::filesystem::path& path);

/// Writes the private key to `path`, for its owner alone (0600), and the public one to `path`.pub
/// (0644 less umask). Neither exists half written at any time. Throws KeyError, and changes
/// nothing, when either file exists already, unless told to replace it.
void write_signing_key(const std::filesystem::path& path, const SigningKey& key, bool replace);

/// The same for a shared key, alone.
void write_shared_key(const std::filesystem::path& path, const SharedKey& key, bool replace);

}  // namespace ellicast::common
