// A guess at what a mistyped name was meant to be.
#pragma once

#include <string>
#include <vector>

namespace crumple {

// The candidate closest in spelling (Levenshtein's distance: letters inserted, left out or exchanged); the first of
// equals. Empty where every candidate differs in more than a third of the name's letters, two at least allowed.
std::string nearest_name(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace crumple
