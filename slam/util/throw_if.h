#pragma once

#include <utility>

#include "slam/util/error.h"

namespace sqslam {

// Throws an error with this message (a format and its values, as in fmt::format()) if `wrong`. The values are
// always evaluated.
template <typename Error, typename... Values>
void ThrowIf(bool wrong, fmt::format_string<Values...> message, Values&&... values) {
  if (wrong) {
    throw Error(fmt::format(message, std::forward<Values>(values)...));
  }
}

}  // namespace sqslam
