#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace ellicast::receiver {

/// File names without extension for pages of these names, all different, also where a file system
/// does not tell upper case from lower. The name itself where it is a safe one
/// (safe_file_stem with so many bytes), else what that makes of it. Where several pages would have
/// one file, a page that is called so keeps it, of several the smallest name; the others get a dash
/// and eight hexadecimal digits of their names' digests. A function of the set of names.
std::map<std::string, std::string> page_stems(const std::vector<std::string>& names,
                                              std::size_t most_bytes);

}  // namespace ellicast::receiver
