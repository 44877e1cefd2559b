// The help texts, made from the verbs themselves.
#pragma once

#include <string>
#include <vector>

#include "cli/verb.h"

namespace crumple {

// `crumple help`: the verbs and what each is for.
std::string program_help(const std::vector<Verb>& verbs);

// `crumple help VERB`: purpose, usage, example, and flags with units and defaults.
std::string verb_help(const Verb& verb);

}  // namespace crumple
