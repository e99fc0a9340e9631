// SPDX-License-Identifier: MIT
#include <device/kernels/patch.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Runs Kernel over random and nasty patches in every build.
template <class Kernel, class T> void check(std::string const& name, unsigned seed, int count) {
  CAPTURE(seed);
  number_source source(seed);
  auto const patches = nasty_patches<T>(source, count);
  auto const parameters = nasty_parameters<T>(source, count);
  auto const results = check_same_in_every_build<T>("patch", name + suffix<T>(), count,
                                                    {readable(patches), readable(parameters)}, [&](T* out) {
                                                      return Kernel{patches.data(), parameters.data(), out};
                                                    });
  CHECK(finite_share(results) > 0.6);
}

}  // namespace

TEMPLATE_TEST_CASE("points and tangents have the same bits from every compiler and from PTX", "", float, double) {
  check<evaluate_kernel<TestType>, TestType>("evaluate", GENERATE(1u, 2u), 1200);
}

TEMPLATE_TEST_CASE("second derivatives and the power form have the same bits from every compiler and from PTX", "",
                   float, double) {
  check<curvature_kernel<TestType>, TestType>("curvature", GENERATE(1u, 2u), 900);
}

TEMPLATE_TEST_CASE("normals, limit normals too, have the same bits from every compiler and from PTX", "", float,
                   double) {
  check<normal_kernel<TestType>, TestType>("normal", GENERATE(1u, 2u), 900);
}

TEMPLATE_TEST_CASE("halves and bounds have the same bits from every compiler and from PTX", "", float, double) {
  check<split_kernel<TestType>, TestType>("split", GENERATE(1u, 2u), 900);
}

TEMPLATE_TEST_CASE("sub-patches have the same bits from every compiler and from PTX", "", float, double) {
  check<sub_patch_kernel<TestType>, TestType>("sub_patch", GENERATE(1u, 2u), 900);
}
