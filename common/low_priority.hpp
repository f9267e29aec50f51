// common/low_priority.hpp
#pragma once

#include <sys/resource.h>
#include <unistd.h>

namespace ellicast::common {

/// Has the calling thread, and those that it starts from now on, give way to whoever keeps up with
/// a network. For good: only privileged programs can take it back.
inline void lower_priority() {
    constexpr int kNiceness = 10;
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNiceness);
}

}  // namespace ellicast::common
