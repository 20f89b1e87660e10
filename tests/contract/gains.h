// What must be above zero in any configuration of a method that the drive accepts: for the survey of random
// parameters in tests/unit/drive/config_test.cpp, which reads x_gains.h of every method of the list.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "tests/contract/firmware.h"

namespace gains
{

using Names = std::vector<std::pair<const char *, int64_t>>;

} // namespace gains
