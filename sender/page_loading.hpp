#pragma once

#include <cstddef>
#include <string>

#include "protocol/datagram.hpp"
#include "sender/model_loading.hpp"
#include "sender/options.hpp"
#include "sender/round_plan.hpp"

namespace ellicast::sender {

/// Loads the model of a page as the options say, certified where they ask for it, with the page's
/// name, and says in the log what there is to say of it. Progress goes to stderr when `progress`.
/// Throws common::ModelError, one line that names the path and the reason.
LoadedModel load_page(std::size_t page, const std::string& name, const Options& options,
                      bool progress);

/// The same up to the decomposition, which goes to options.decompose_only (set).
LoadedModel decompose_page(std::size_t page, const Options& options, bool progress);

/// The plan of a model's object, which it takes out of it. `paged`: see PlanOptions.
RoundPlan make_plan(LoadedModel& model, const Options& options, const protocol::SessionId& session,
                    bool paged);

}  // namespace ellicast::sender
