// sender/key_command.hpp: `ellicast-send key`
#pragma once

namespace ellicast::sender {

/// Makes a key from the operating system's random source and writes it, as the command line asks:
/// argv[0] is "key". Gives the exit code: 0, or 2 after a line on stderr that names what is wrong.
int run_key_command(int argc, const char* const* argv);

}  // namespace ellicast::sender
