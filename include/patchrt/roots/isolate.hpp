// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// All roots of two tensor-product Bernstein polynomials in a rectangle, with a certificate.

#include <patchrt/roots/isolation.hpp>
#include <patchrt/roots/krawczyk.hpp>
#include <patchrt/roots/refine_root.hpp>
#include <patchrt/roots/root_clusters.hpp>

namespace patchrt {
namespace detail {

/// The state of one search.
template <scalar T, int M, int N, int Capacity> class root_search {
  using R = real_t<T>;
  using box_type = parameter_box<R>;

 public:
  PATCHRT_HD root_search(bernstein_pair<T, M, N> const& pair, isolate_options<T> const& options,
                         isolation<T, Capacity>& out)
      : pair_(scaled(pair)), options_(options), out_(out) {}

  PATCHRT_HD void run() {
    out_.count = 0;
    out_.complete = pair_.is_finite;
    out_.examined = 0;
    if (!pair_.is_finite) return report_domain();
    box_type const& d = options_.domain;
    queue_.push({grid_below(d.u_low), grid_above(d.u_high), grid_below(d.v_low), grid_above(d.v_high)});
    while (!queue_.is_empty()) {
      box_type const box = queue_.pop();
      if (is_done(box)) continue;
      if (has_given_up_ || out_.examined >= options_.most_examined) clusters_.add(box, true);
      else decide(box);
    }
    report_clusters();
  }

 private:
  scaled_pair<T, M, N> pair_;
  isolate_options<T> options_;
  isolation<T, Capacity>& out_;
  box_type single_[Capacity];  ///< root k is the only one in single_[k]
  box_queue<R, 160> queue_;
  root_clusters<R> clusters_;
  bool has_given_up_ = false;  ///< more boxes are undecided than isolated roots would leave

  PATCHRT_HD static R middle(R low, R high) { return grid_below(low + (high - low) / R(2)); }

  PATCHRT_HD bool is_done(box_type const& box) const {
    for (int k = 0; k < out_.count; ++k) {
      if (is_inside(box, single_[k])) return true;
    }
    return false;
  }

  PATCHRT_HD void decide(box_type box) {
    ++out_.examined;
    box_facts<R> const facts = examine(pair_, box);
    if (facts.is_excluded) return;
    if (facts.is_vanishing) return clusters_.add(box, false);
    box_type const before = box;
    contract<M>(facts.row[0], box.u_low, box.u_high);
    contract<N>(facts.row[1], box.v_low, box.v_high);
    if (!(box.u_low <= box.u_high && box.v_low <= box.v_high) || is_done(box)) return;
    if (is_injective(facts) && is_proven_single(box, before)) return;
    if (is_at_floor(facts) && is_narrow(box)) return clusters_.add(box, false);
    split(box, facts);
  }

  PATCHRT_HD bool is_narrow(box_type const& box) const {
    return box.u_high - box.u_low <= options_.widest_multiple && box.v_high - box.v_low <= options_.widest_multiple;
  }

  /// Looks for the one root in a box around `box`, as interval Newton needs it inside: first one that leaves room for
  /// others to be told the same by, then a close one.
  PATCHRT_HD bool is_proven_single(box_type const& box, box_type const& before) {
    R const width_u = box.u_high - box.u_low, width_v = box.v_high - box.v_low;
    return is_single_around(box, max(width_u / R(2), (before.u_high - before.u_low) / R(8)),
                            max(width_v / R(2), (before.v_high - before.v_low) / R(8))) ||
           is_single_around(box, width_u / R(8), width_v / R(8));
  }

  PATCHRT_HD bool is_single_around(box_type const& box, R margin_u, R margin_v) {
    R const h = overhang<R>();
    box_type const around{grid_below(max(box.u_low - margin_u, -h)), grid_above(min(box.u_high + margin_u, R(1) + h)),
                          grid_below(max(box.v_low - margin_v, -h)), grid_above(min(box.v_high + margin_v, R(1) + h))};
    ++out_.examined;
    box_facts<R> const facts = examine(pair_, around);
    if (facts.is_excluded) return true;
    if (facts.is_vanishing || !has_exactly_one(facts)) return false;
    isolated_root<T> root;
    if (!refine_root(pair_, around, facts, root)) return false;
    box_type const tight = box_of(root);
    box_type const& d = options_.domain;
    if (tight.u_high < d.u_low || d.u_high < tight.u_low || tight.v_high < d.v_low || d.v_high < tight.v_low)
      return true;
    root.on_border = is_on_border(tight);
    for (int k = 0; k < out_.count; ++k) {
      if (is_inside(tight, single_[k])) return true;
      box_type const other = box_of(out_.roots[k]);
      if (is_touching(tight, other)) return is_inside(other, around);
    }
    if (out_.count == Capacity - 1) {
      clusters_.add(box, true);
      return true;
    }
    single_[out_.count] = around;
    out_.roots[out_.count++] = root;
    return true;
  }

  /// The root's box, rounded outward.
  PATCHRT_HD static box_type box_of(isolated_root<T> const& r) {
    R const slack = std::numeric_limits<R>::epsilon();
    T const ru(r.radius_u), rv(r.radius_v);
    return {enclosure<T>::lower(r.u - ru) - slack, enclosure<T>::upper(r.u + ru) + slack,
            enclosure<T>::lower(r.v - rv) - slack, enclosure<T>::upper(r.v + rv) + slack};
  }

  PATCHRT_HD bool is_on_border(box_type const& box) const {
    box_type const& d = options_.domain;
    return !(d.u_low < box.u_low && box.u_high < d.u_high && d.v_low < box.v_low && box.v_high < d.v_high);
  }

  /// Halves the box along the parameters that the functions vary with.
  PATCHRT_HD void split(box_type const& box, box_facts<R> const& facts) {
    R const u = middle(box.u_low, box.u_high), v = middle(box.v_low, box.v_high);
    bool const can_u = box.u_low < u && u < box.u_high, can_v = box.v_low < v && v < box.v_high;
    bool const in_u = can_u && (!can_v || R(4) * facts.variation_u >= facts.variation_v);
    bool const in_v = can_v && (!can_u || R(4) * facts.variation_v >= facts.variation_u);
    if (!in_u && !in_v) return clusters_.add(box, false);
    if (queue_.room() < 4) {
      has_given_up_ = true;
      return clusters_.add(box, true);
    }
    for (int k = 0; k < 4; ++k) {
      if ((!in_u && (k & 1)) || (!in_v && (k & 2))) continue;
      queue_.push({in_u && (k & 1) ? u : box.u_low, in_u && !(k & 1) ? u : box.u_high, in_v && (k & 2) ? v : box.v_low,
                   in_v && !(k & 2) ? v : box.v_high});
    }
  }

  /// Of a pair that is not made of numbers.
  PATCHRT_HD void report_domain() {
    box_type const& d = options_.domain;
    R const unknown = std::numeric_limits<R>::infinity();
    out_.count = 1;
    out_.roots[0] = {T(d.u_low), T(d.v_low), d.u_high - d.u_low,    d.v_high - d.v_low,
                     unknown,    unknown,    root_kind::degenerate, true};
  }

  PATCHRT_HD void report_clusters() {
    for (int k = clusters_.count() - 1; k >= 0; --k) {
      if (is_done(clusters_[k].box)) clusters_.remove(k);
    }
    clusters_.settle(Capacity - out_.count);
    for (int k = 0; k < clusters_.count(); ++k) {
      auto const& c = clusters_[k];
      if (c.is_unfinished) out_.complete = false;
      isolated_root<T>& r = out_.roots[out_.count++];
      approach_root(pair_, c.box, r);
      r.kind = !c.is_unfinished && is_narrow(c.box) ? root_kind::multiple : root_kind::degenerate;
      r.on_border = is_on_border(c.box);
    }
  }
};

}  // namespace detail

/// All roots of f = g = 0 in the domain, for the given pair and every pair within its errors.
///
/// The union of the boxes holds every such root; a box of kind `simple` holds exactly one, for each pair, a root on a
/// border of the domain included, which may then be just outside. A simple root is found once, within |J^-1| times
/// error and rounding, the latter 3 (M + N) units (half an epsilon) of the largest coefficient, give or take what J
/// changes on the way.
///
/// Boxes are excluded by their coefficients and by those of combinations, contracted, proved to hold one root, or
/// halved, breadth first. A contact of two curves ends as one box, about as wide as the square root of error and
/// rounding; roots nearer to each other than ten times that may too. No more than `most_examined` steps are taken, and
/// no more than 160 boxes are kept waiting, which isolated roots stay far below: what is left then is reported as
/// `degenerate`.
/// \pre the domain is in [0, 1]^2
template <scalar T, int M, int N, int Capacity = isolation_capacity<M, N>>
PATCHRT_HD isolation<T, Capacity> isolate(bernstein_pair<T, M, N> const& pair, isolate_options<T> const& options = {}) {
  static_assert(Capacity >= 2);
  PATCHRT_EXPECTS(is_inside(options.domain, {real_t<T>(0), real_t<T>(1), real_t<T>(0), real_t<T>(1)}));
  isolation<T, Capacity> out;
  detail::root_search<T, M, N, Capacity> search(pair, options, out);
  search.run();
  return out;
}

}  // namespace patchrt
