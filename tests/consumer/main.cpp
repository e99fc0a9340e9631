// SPDX-License-Identifier: MIT
// A program outside the project. Bits depend on -ffp-contract=off reaching it: contracted, a b - c would keep the rounding
// error of a b and not be zero.
#include <patchrt/core/ray.hpp>
#if defined(WITH_PACK)
#  include <patchrt/numbers/pack.hpp>
#endif

int main(int argc, char**) {
  double const a = 1.0 + 1e-9 * argc;
  double volatile again = a;
  double const square = again * a;
  again = square;
  bool const contracted = a * a - again != 0.0;
  patchrt::ray<double> const r{{0, 0, 0}, {3, 4, 0}, 0, 1};
  bool ok = patchrt::dot(r.direction, r.direction) == 25.0 && !contracted;
#if defined(WITH_PACK)
  ok = ok && patchrt::scalar<patchrt::pack<float, 8>>;
#endif
  return ok ? 0 : 1;
}
