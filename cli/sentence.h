// How the program ends its sentences.
#pragma once

#include <string>

namespace crumple {

// Libraries leave the full stop off, so that messages can be put into one another. Here every line of `message` gets
// one, unless it ends in . ! ? or : already.
std::string as_sentences(const std::string& message);

}  // namespace crumple
