// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The steps of a ray-patch solver by themselves: one ray, one cell of a patch that is known to hold one root.

#include "accuracy_rows.hpp"
#include "level_judge.hpp"
#include "unfused.hpp"

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/intersect/ray_patch.hpp>
#include <patchrt/intersect/reference_root.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/two_float.hpp>

#include <memory>

namespace patchrt::bench {

/// A root of a ray in a cell of a patch. Lengths are the model's times `scale`, a power of two that makes the patch of size 1;
/// the patch is about 0, and the ray starts two sizes before the root. `truth` are all roots of the ray as it is rounded, on this patch.
struct solver_case {
  bicubic_patch<double> patch;
  power_patch<double> power;
  double size;
  vec3<double> origin, direction;
  patch_cell<double> cell;
  std::vector<real3> truth;
  double per_diagonal;  ///< what lengths are multiplied by to be in the model's diagonals
  double per_ulp;       ///< and in epsilons of (the patch's diagonal + distance)
};

/// The point where a ray meets a patch near (u, v), by Newton's method in long double.
inline real3 polish(bicubic_patch<double> const& patch, real3 const& origin, real3 const& direction, real u, real v) {
  auto const outer = [](real3 const& a, real3 const& b) {
    return real3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  };
  for (int step = 0; step < 4; ++step) {
    exact_point const p = evaluate_exactly(patch, u, v);
    real3 const r = origin - p.s, across_v = outer(p.sv, direction), across_u = outer(direction, p.su);
    real const det = inner(p.su, across_v);
    if (det == 0) break;
    u += inner(r, across_v) / det;
    v += inner(r, across_u) / det;
  }
  return evaluate_exactly(patch, u, v).s;
}

/// The cell of an 8 x 8 cut that a root is in; none for roots outside [0, 1].
inline std::optional<solver_case> make_case(test::patch_list const& scene, model_size const& size, ray<double> const& r,
                                            std::span<test::oracle_root const> roots, test::oracle_root const& root) {
  if (root.u < 0 || root.u > 1 || root.v < 0 || root.v > 1) return {};
  auto const& given = scene[std::size_t(root.patch)];
  box<double> const b = bounds(given);
  vec3<double> const base = 0.5 * (b.lo + b.hi);
  double const diagonal = size.patch_diagonals[std::size_t(root.patch)];
  double const scale = std::exp2(-std::ceil(std::log2(0.5 * diagonal)));
  solver_case c;
  c.size = 0;
  for (int k = 0; k < 16; ++k) {
    vec3<double> const p = (given.control_points[k] - base) * scale;
    c.patch.control_points[k] = p;
    c.size = std::max({c.size, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
  }
  c.power = to_power(c.patch);
  real const length = test::norm(r.direction);
  real3 const d = real3(r.direction) / length;
  c.direction = vec3<double>(d);
  real3 const start = evaluate_exactly(c.patch, root.u, root.v).s - real(2) * d;
  c.origin = vec3<double>(start);
  for (auto const& other : roots)
    if (other.patch == root.patch && !other.singular)
      c.truth.push_back(polish(c.patch, real3(c.origin), real3(c.direction), other.u, other.v));
  double const cells = 8;
  auto const middle = [&](real u) { return (2 * std::min(std::floor(double(u) * cells), cells - 1) + 1) / cells - 1; };
  c.cell = {middle(root.u), middle(root.v), 1 / cells, 1 / cells, {0, 0, 0}};
  c.per_diagonal = 1 / (scale * size.diagonal);
  c.per_ulp = 1 / (scale * std::numeric_limits<double>::epsilon() * (diagonal + double(std::abs(root.t) * length)));
  return c;
}

/// What a solver gives: (u, v), and whether it says that this is a root.
struct solver_answer {
  double u, v;
  bool is_root;
};

/// Errors of answers: their distance from the nearest root, which beside a silhouette may be another than the cell's. One
/// farther than a twentieth of the patch from every root, or that is not called a root, is lost.
inline error_list judge_answers(std::span<solver_case const> cases, std::span<solver_answer const> answers) {
  error_list e;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    auto const& c = cases[i];
    auto const& a = answers[i];
    if (!(a.u - a.u == 0 && a.v - a.v == 0)) {
      ++e.not_numbers;
      continue;
    }
    double off = std::numeric_limits<double>::infinity();
    for (real3 const& root : c.truth)
      off = std::min(off, double(bench::length(evaluate_exactly(c.patch, a.u, a.v).s - root)));
    if (!a.is_root || off > 0.1) {
      ++e.lost;
      continue;
    }
    e.diagonals.push_back(off * c.per_diagonal);
    e.ulps.push_back(off * c.per_ulp);
  }
  return e;
}

/// A case in numbers of type T.
template <class T> struct solver_input {
  power_patch<T> power;
  vec3<T> reach, origin, n1, n2, abs_n1, abs_n2;
  patch_cell<T> cell;
};

template <class T> T to_number(double x) {
  if constexpr (std::is_same_v<T, unfused<float>>) return T(float(x));
  else return T(x);
}
template <class T> vec3<T> to_numbers(vec3<double> const& v) {
  return {to_number<T>(v.x), to_number<T>(v.y), to_number<T>(v.z)};
}

template <class T> solver_input<T> make_input(solver_case const& c) {
  solver_input<T> in;
  for (int k = 0; k < 16; ++k) in.power.coefficients[k] = to_numbers<T>(c.power.coefficients[k]);
  vec3<double> const sums = coefficient_sum(c.power);
  in.reach = to_numbers<T>(sums + absolute(c.origin));
  in.origin = to_numbers<T>(c.origin);
  plane_normals(to_numbers<T>(c.direction), in.n1, in.n2);
  in.abs_n1 = absolute(in.n1);
  in.abs_n2 = absolute(in.n2);
  in.cell = {to_number<T>(c.cell.x),
             to_number<T>(c.cell.y),
             to_number<T>(c.cell.half_x),
             to_number<T>(c.cell.half_y),
             {to_number<T>(0), to_number<T>(0), to_number<T>(0)}};
  return in;
}

/// `project`, also for types that integers do not mix with.
template <class T> PATCHRT_INLINE projected_patch<T> project_input(solver_input<T> const& in) {
  if constexpr (std::is_convertible_v<int, T>) {
    return project(in.power, in.reach, in.origin, in.n1, in.n2);
  } else {
    projected_patch<T> p;
    T const unit(16 * double(std::numeric_limits<T>::epsilon()));
    p.rounding_f = unit * dot(in.abs_n1, in.reach);
    p.rounding_g = unit * dot(in.abs_n2, in.reach);
    for (int k = 0; k < 16; ++k) {
      p.f[k] = dot(in.n1, in.power.coefficients[k]);
      p.g[k] = dot(in.n2, in.power.coefficients[k]);
    }
    p.f[0] = p.f[0] - dot(in.n1, in.origin);
    p.g[0] = p.g[0] - dot(in.n2, in.origin);
    return p;
  }
}

/// How Newton's iteration is run.
struct newton_options {
  bool from_linear_root = true;  ///< else from the cell's middle
  double tolerance = 0;          ///< 0: until the functions are no more than their rounding
  int max_steps = 16;
  bool needs_convergence = true;
};

template <class T> newton_result<T> run_newton(solver_input<T> const& in, newton_options const& how) {
  auto const p = project_input(in);
  T x = in.cell.x, y = in.cell.y;
  if (how.from_linear_root) {
    auto const begin = linear_start(p, in.abs_n1, in.abs_n2, in.cell);
    x = begin.x;
    y = begin.y;
  }
  T const two = to_number<T>(2);
  return newton(p, x, y, two * in.cell.half_x, two * in.cell.half_y, true, to_number<T>(how.tolerance), how.max_steps);
}

inline double unit_of(double x) { return 0.5 + 0.5 * x; }

/// Newton's iteration in T on every case.
template <class T>
accuracy_row newton_row(std::string study, std::string workload, std::string method, std::string number,
                        std::string value, std::span<solver_case const> cases, newton_options how) {
  auto const inputs = std::make_shared<std::vector<solver_input<T>>>();
  std::vector<solver_answer> answers;
  for (auto const& c : cases) {
    inputs->push_back(make_input<T>(c));
    auto const n = run_newton(inputs->back(), how);
    answers.push_back({unit_of(double(n.x)), unit_of(double(n.y)), n.converged || !how.needs_convergence});
  }
  return {std::move(study),
          std::move(workload),
          method,
          std::move(number),
          std::move(value),
          cases.size(),
          judge_answers(cases, answers),
          {method, [inputs, how] {
             for (auto const& in : *inputs) {
               auto const n = run_newton(in, how);
               [[maybe_unused]] auto volatile const seen = double(n.x);
             }
           }}};
}

/// The ways from a root in float, or from the cell's middle, to one in double.
enum class correction { none, chords, newton_on_patch, reference, reference_absolute };

/// A case with what the corrections in double need.
struct correction_input {
  solver_input<float> search;
  solver_case const* exact;
  double rounding, per_square;
};

inline solver_answer correct_case(correction_input const& in, correction how, double scale) {
  solver_case const& c = *in.exact;
  patch_root<double> root{0, unit_of(c.cell.x), unit_of(c.cell.y), 0, true};
  if (how == correction::reference || how == correction::reference_absolute) {
    // The threshold is 1e-15 of (size + |origin|): with this `size` it is 1e-15 of a unit of length.
    double const reach = std::fabs(c.origin.x) + std::fabs(c.origin.y) + std::fabs(c.origin.z);
    double const size = how == correction::reference ? c.size : 1 / scale - reach;
    solve_on_planes(c.patch, size, c.origin, c.direction, root);
    return {root.u, root.v, root.valid};
  }
  auto const n = run_newton(in.search, {true, 0x1p-10, 10, true});
  root.u = unit_of(double(n.x));
  root.v = unit_of(double(n.y));
  root.valid = n.converged;
  if (how == correction::newton_on_patch) {
    correct(c.patch, c.size, {}, c.origin, c.direction, root);
  } else if (how == correction::chords) {
    auto const rows = make_chord_rows(evaluate(in.search.power, n.x, n.y), vec3<float>(c.direction));
    auto const spread = [](vec3<float> const& v) { return vec3<double>(v); };
    chord_rows<double> const own{spread(rows.x), spread(rows.y), spread(rows.t), double(rows.per_cosine)};
    patch_root<double> by_chords;
    auto const steps = correct_by_chords(c.power, in.rounding, own, 1., double(n.x), double(n.y), c.origin, c.direction,
                                         in.per_square, by_chords);
    if (steps.settled) return {by_chords.u, by_chords.v, n.converged};
    correct(c.patch, c.size, {}, c.origin, c.direction, root);
  }
  return {root.u, root.v, root.valid};
}

/// \param scale how many units of length a patch is across: what absolute thresholds depend on.
inline accuracy_row correction_row(std::string study, std::string workload, std::string method, std::string value,
                                   std::span<solver_case const> cases, correction how, double scale = 1) {
  auto const inputs = std::make_shared<std::vector<correction_input>>();
  std::vector<solver_answer> answers;
  for (auto const& c : cases) {
    vec3<double> const sums = coefficient_sum(c.power);
    inputs->push_back({make_input<float>(c), &c,
                       20 * std::numeric_limits<double>::epsilon() * (sums.x + sums.y + sums.z),
                       1 / dot(c.direction, c.direction)});
    answers.push_back(correct_case(inputs->back(), how, scale));
  }
  return {std::move(study),
          std::move(workload),
          method,
          how == correction::none                                           ? "float"
          : how == correction::chords || how == correction::newton_on_patch ? "float, double"
                                                                            : "double",
          std::move(value),
          cases.size(),
          judge_answers(cases, answers),
          {method, [inputs, how, scale] {
             for (auto const& in : *inputs) {
               [[maybe_unused]] auto volatile const seen = correct_case(in, how, scale).u;
             }
           }}};
}

/// Every study of the solver by itself on one list of cases.
inline void add_solver_rows(std::vector<accuracy_row>& rows, std::string const& workload,
                            std::span<solver_case const> cases) {
  using single = float;
  for (int steps = 1; steps <= 16; ++steps)
    for (bool const linear : {true, false}) {
      newton_options const how{linear, 0, steps, false};
      std::string const method = linear ? "Newton, linear start" : "Newton, from the middle";
      auto const value = std::to_string(steps);
      rows.push_back(newton_row<single>("steps", workload, method, "float", value, cases, how));
      rows.push_back(newton_row<double>("steps", workload, method, "double", value, cases, how));
    }
  for (int digits = 2; digits <= 26; digits += 4) {
    newton_options const how{true, std::exp2(-digits), 16, true};
    auto const value = "2^-" + std::to_string(digits);
    rows.push_back(newton_row<single>("tolerance", workload, "Newton", "float", value, cases, how));
    rows.push_back(newton_row<double>("tolerance", workload, "Newton", "double", value, cases, how));
  }
  auto const add_number = [&]<class T>(char const* study, char const* number) {
    rows.push_back(newton_row<T>(study, workload, "Newton, 16 steps", number, "", cases, {true, 0, 16, false}));
  };
  add_number.operator()<fixed<std::int16_t, 8>>("numbers", "fixed<int16, 8>");
  add_number.operator()<half>("numbers", "half");
  add_number.operator()<single>("numbers", "float");
  add_number.operator()<unfused<float>>("numbers", "float, no fma");
  add_number.operator()<two_float<float>>("numbers", "two_float<float>");
  add_number.operator()<double>("numbers", "double");
  add_number.operator()<unfused<double>>("numbers", "double, no fma");
  auto const add = [&](char const* study, char const* method, char const* value, correction how, double scale = 1) {
    rows.push_back(correction_row(study, workload, method, value, cases, how, scale));
  };
  add("correction", "float search", "", correction::none);
  add("correction", "+ two chord steps", "", correction::chords);
  add("correction", "+ Newton on the patch", "", correction::newton_on_patch);
  add("correction", "paper, from the middle", "", correction::reference);
  add("threshold", "paper, relative 1e-15", "any size", correction::reference);
  add("threshold", "paper, absolute 1e-15", "1e-6", correction::reference_absolute, 0x1p-20);
  add("threshold", "paper, absolute 1e-15", "1", correction::reference_absolute, 1);
  add("threshold", "paper, absolute 1e-15", "1e6", correction::reference_absolute, 0x1p20);
}

}  // namespace patchrt::bench
