// common/parallel.hpp
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace ellicast::common {

/// Calls body(begin, end) on disjoint ranges that together make [0, count), on up to `threads`
/// threads (0: one per core), and returns when all are done. The body must write only what its own
/// range owns; then the result does not depend on the number of threads. The first exception thrown
/// is rethrown.
template <class Body>
void parallel_for(std::size_t count, unsigned threads, const Body& body) {
    if (threads == 0) threads = std::max(1u, std::thread::hardware_concurrency());
    const std::size_t parts = std::min<std::size_t>(threads, count);
    if (parts <= 1) {
        if (count > 0) body(std::size_t{0}, count);
        return;
    }
    std::vector<std::exception_ptr> failures(parts);
    std::vector<std::jthread> workers;
    workers.reserve(parts - 1);
    const auto run = [&](std::size_t part) {
        try {
            body(count * part / parts, count * (part + 1) / parts);
        } catch (...) {
            failures[part] = std::current_exception();
        }
    };
    for (std::size_t part = 1; part < parts; ++part) workers.emplace_back(run, part);
    run(0);
    workers.clear();  // joins
    for (const std::exception_ptr& failure : failures) {
        if (failure) std::rethrow_exception(failure);
    }
}

}  // namespace ellicast::common
