// common/parallel.hpp
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <future>
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

/// What part(begin, end) says of each stretch of `size` items in [0, count), the last one shorter.
/// Added up in this order, sums are the same on any number of threads.
template <class Part>
auto in_parts(std::size_t count, std::size_t size, unsigned threads, const Part& part) {
    std::vector<decltype(part(std::size_t{}, std::size_t{}))> results((count + size - 1) / size);
    parallel_for(results.size(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) {
            results[k] = part(k * size, std::min(count, (k + 1) * size));
        }
    });
    return results;
}

/// The parts one after another; they are given up on the way, so that they are not there twice.
template <class Item>
std::vector<Item> joined(std::vector<std::vector<Item>> parts) {
    std::size_t size = 0;
    for (const std::vector<Item>& part : parts) size += part.size();
    std::vector<Item> all;
    all.reserve(size);
    for (std::vector<Item>& part : parts) {
        all.insert(all.end(), part.begin(), part.end());
        part = {};
    }
    return all;
}

/// Work that goes on beside the caller's; where there is one thread alone, when its result is asked
/// for. The future waits for it wherever it ends.
template <class Work>
auto beside(unsigned threads, const Work& work) {
    return std::async(threads == 1 ? std::launch::deferred : std::launch::async, work);
}

}  // namespace ellicast::common
