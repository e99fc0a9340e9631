// SPDX-License-Identifier: MIT
#include <device/kernels/core.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

using namespace patchrt;
using namespace patchrt::test;

TEMPLATE_TEST_CASE("products, roots, order and signs have the same bits from every compiler and from PTX", "", float,
                   double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 3000;
  std::vector<T> numbers;
  for (int i = 0; i < count * arithmetic_kernel<T>::inputs; ++i) numbers.push_back(source.nasty<T>(20));
  auto const results =
      check_same_in_every_build<T>("core", "arithmetic" + suffix<T>(), count, {readable(numbers)}, [&](T* out) {
        return arithmetic_kernel<T>{numbers.data(), out};
      });
  CHECK(finite_share(results) > 0.8);
}

TEMPLATE_TEST_CASE("twin planes have the same bits from every compiler and from PTX", "", float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  number_source source(seed);
  auto const rays = nasty_rays<T>(source, 3000);
  auto const results =
      check_same_in_every_build<T>("core", "planes" + suffix<T>(), 3000, {readable(rays)}, [&](T* out) {
        return planes_kernel<T>{rays.data(), out};
      });
  CHECK(finite_share(results) > 0.7);
}

TEMPLATE_TEST_CASE("a ray's way through a box has the same bits from every compiler and from PTX", "", float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 3000;
  auto const rays = nasty_rays<T>(source, count);
  std::vector<box<T>> boxes;
  for (int i = 0; i < count; ++i) boxes.push_back({source.nasty_point<T>(30), source.nasty_point<T>(30)});
  auto const results =
      check_same_in_every_build<T>("core", "slab" + suffix<T>(), count, {readable(rays), readable(boxes)}, [&](T* out) {
        return slab_kernel<T>{rays.data(), boxes.data(), out};
      });
  CHECK(finite_share(results) > 0.7);
}

TEST_CASE("PTX on the CPU refuses reads outside the buffers, writes to inputs and misaligned addresses") {
  std::vector<ray<float>> const rays(4, ray<float>{{0, 0, 0}, {0, 0, 1}, 0, 1});
  std::vector<float> results(4 * planes_kernel<float>::outputs + 1);
  auto const run = [&](build const& b, std::size_t ray_count, bool writable, char* out) {
    memory_range const input{rays.data(), rays.data() + ray_count, false};
    memory_range const output{results.data(), results.data() + results.size(), writable};
    launch(b.kernel("planes_f32"), planes_kernel<float>{rays.data(), reinterpret_cast<float*>(out)}, 4,
           {input, output});
  };
  char* const out = reinterpret_cast<char*>(results.data());
  for (build const& b : builds_of("core")) {
    if (!b.is_ptx) continue;
    CHECK_NOTHROW(run(b, 4, true, out));
    CHECK_THROWS_WITH(run(b, 3, true, out), contains_text("read"));
    CHECK_THROWS_WITH(run(b, 4, false, out), contains_text("write"));
    CHECK_THROWS_WITH(run(b, 4, true, out + 2), contains_text("misaligned"));
    CHECK_THROWS_WITH(run(b, 4, true, out + 8), contains_text("write"));
  }
}
