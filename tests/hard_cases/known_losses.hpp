// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What levels are known to get wrong, by the row's name.

#include "hard_case.hpp"

namespace patchrt::test {

struct known_loss {
  std::string name;
  unsigned lost;     ///< levels whose promise does not cover the row
  unsigned defects;  ///< levels whose promise does: to be mended
};

inline std::vector<known_loss> known_losses() {
  return {
      {"two roots to either side of a contact, apart by 2^-19", in_reference, 0u},
      {"two roots to either side of a contact, apart by 2^-21", in_reference, 0u},
      {"two roots to either side of a contact, apart by 2^-23", in_reference, 0u},
      {"a ray that passes a trough at 2^-20", in_fast, 0u},
      {"a ray that passes a trough at 2^-30", in_fast, 0u},
      {"a ray that passes a trough at 2^-40", in_fast, 0u},
      {"three roots at an inflection, apart by 2^-12", in_reference, 0u},
      {"a near miss of one patch and a hit on the next", in_fast, 0u},
      {"a root beyond a valley that is no root by 2^-20", in_fast, 0u},
      {"a root beyond a valley that is no root by 2^-32", in_fast, 0u},
      {"a root beyond a valley that is no root by 2^-40", in_fast, 0u},
      {"the only root lies beyond the border by 2^-20", in_fast, 0u},
      {"the only root lies beyond the border by 2^-30", in_fast, 0u},
      {"the only root lies beyond the border by 2^-40", in_fast, 0u},
      {"beside the crease of a flat patch folded on itself", in_fast, 0u},
      {"Whitney's umbrella along its double line", 0u, in_certified},
      {"the collapsed corner of a triangle, from the side", in_reference, 0u},
      {"before the collapsed corner of a triangle by 2^-20", in_fast, 0u},
      {"the apex of a cone", in_reference, 0u},
      {"a dome's pole where tangents vanish too", in_reference, 0u},
      {"cubes beside the corner where tangents vanish by 2^-45", in_reference, 0u},
      {"beside a line inside where a tangent vanishes by 2^-45", in_reference, 0u},
      {"the corner where tangents vanish", in_reference, 0u},
      {"the corner where second derivatives vanish too", in_reference, 0u},
      {"a line inside where a tangent vanishes", in_reference, 0u},
      {"a point inside where both tangents vanish", in_reference, 0u},
      {"past a patch that is a line", in_fast, 0u},
      {"through a patch that is a point", 0u, in_certified},
      {"past a patch that is a curve", in_fast, 0u},
      {"a square edge-on, beside its plane by 2^-20", in_fast, 0u},
      {"a square edge-on, beside its plane by 2^-40", in_fast, 0u},
      {"beside a cylinder's ruling by 2^-20", in_fast, 0u},
      {"a border curve", in_reference, 0u},
      {"a corner", in_reference, 0u},
      {"a corner, aslant", in_reference, 0u},
      {"outside a border by 2^-20", in_fast, 0u},
      {"outside a border by 2^-30", in_fast, 0u},
      {"outside a border by 2^-40", in_fast, 0u},
      {"from 2^-30 before the first root", in_fast, 0u},
      {"up to 2^-30 behind the last root", in_fast, 0u},
      {"a direction of length 2^60", in_fast, 0u},
      {"past a sliver of width 2^-20", in_fast, 0u},
      {"past a sliver of width 2^-30", in_fast, 0u},
      {"a patch away from the origin by 2^30", in_fast, 0u},
      {"a patch as high as 2^30", in_fast, 0u},
      {"past a sliver of width 2^-40", in_fast, 0u},
      {"a patch away from the origin by 2^40", in_fast, 0u},
  };
}

}  // namespace patchrt::test
