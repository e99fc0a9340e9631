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
    out_.complete = true;
    out_.examined = 0;
    if (!pair_.is_finite) {
      R const none = std::numeric_limits<R>::infinity();
      out_.roots[out_.count++] = {T(middle(options_.domain.u_low, options_.domain.u_high)),
                                  T(middle(options_.domain.v_low, options_.domain.v_high)),
                                  rounded_up(options_.domain.u_high - options_.domain.u_low),
                                  rounded_up(options_.domain.v_high - options_.domain.v_low),
                                  none,
                                  none,
                                  root_kind::degenerate,
                                  true};
      out_.complete = false;
      return;
    }
    queue_.push(options_.domain);
    while (!queue_.is_empty()) {
      box_type const box = queue_.pop();
      if (is_done(box)) continue;
      if (out_.examined < options_.most_examined) decide(box);
      else leave(box, true);
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

  PATCHRT_HD static R middle(R low, R high) { return low + (high - low) / R(2); }

  PATCHRT_HD bool is_done(box_type const& box) const {
    for (int k = 0; k < out_.count; ++k) {
      if (is_inside(box, single_[k])) return true;
    }
    return false;
  }

  PATCHRT_HD void leave(box_type const& box, bool is_unfinished) {
    clusters_.add(box, is_unfinished);
    if (is_unfinished) out_.complete = false;
  }

  PATCHRT_HD void decide(box_type box) {
    ++out_.examined;
    box_facts<R> const facts = examine(pair_, box);
    if (facts.is_excluded) return;
    if (facts.is_vanishing) return leave(box, false);
    R const width_u = box.u_high - box.u_low, width_v = box.v_high - box.v_low;
    contract(facts.row[0], box.u_low, box.u_high);
    contract(facts.row[1], box.v_low, box.v_high);
    if (!(box.u_low <= box.u_high && box.v_low <= box.v_high) || is_done(box)) return;
    if (is_injective(facts) && is_proven_single(box, width_u, width_v)) return;
    if (is_at_floor(facts) && is_narrow(box)) return leave(box, false);
    split(box, facts);
  }

  PATCHRT_HD bool is_narrow(box_type const& box) const {
    return box.u_high - box.u_low <= options_.widest_multiple && box.v_high - box.v_low <= options_.widest_multiple;
  }

  /// Looks for the one root in a box around `box`, as interval Newton needs it inside.
  PATCHRT_HD bool is_proven_single(box_type const& box, R before_u, R before_v) {
    R const h = overhang<R>();
    R const margin_u = max((box.u_high - box.u_low) / R(2), before_u / R(8));
    R const margin_v = max((box.v_high - box.v_low) / R(2), before_v / R(8));
    box_type const around{max(box.u_low - margin_u, -h), min(box.u_high + margin_u, R(1) + h),
                          max(box.v_low - margin_v, -h), min(box.v_high + margin_v, R(1) + h)};
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
    if (out_.count == Capacity - 1) return false;
    single_[out_.count] = around;
    out_.roots[out_.count++] = root;
    return true;
  }

  PATCHRT_HD static box_type box_of(isolated_root<T> const& r) {
    return {enclosure<T>::lower(r.u - T(r.radius_u)), enclosure<T>::upper(r.u + T(r.radius_u)),
            enclosure<T>::lower(r.v - T(r.radius_v)), enclosure<T>::upper(r.v + T(r.radius_v))};
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
    if ((!in_u && !in_v) || queue_.room() < 4) return leave(box, in_u || in_v);
    for (int k = 0; k < 4; ++k) {
      if ((!in_u && (k & 1)) || (!in_v && (k & 2))) continue;
      queue_.push({in_u && (k & 1) ? u : box.u_low, in_u && !(k & 1) ? u : box.u_high, in_v && (k & 2) ? v : box.v_low,
                   in_v && !(k & 2) ? v : box.v_high});
    }
  }

  PATCHRT_HD void report_clusters() {
    for (int k = clusters_.count() - 1; k >= 0; --k) {
      if (is_done(clusters_[k].box)) clusters_.remove(k);
    }
    clusters_.settle(Capacity - out_.count);
    for (int k = 0; k < clusters_.count(); ++k) {
      auto const& c = clusters_[k];
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
/// The union of the boxes holds every such root; a box of kind `simple` holds exactly one, for each pair, a root on a border of
/// the domain included, which may then be just outside. A simple root is found once. It is within its radius, which is
/// |J^-1| times error and rounding, a few times 12 (M + N) units of the largest coefficient.
///
/// Boxes are excluded by their coefficients and those of combinations, contracted, proved single, or halved, breadth first; no more
/// than `most_examined` steps, then what is left is reported as `degenerate`. A contact of two curves is reported as one box about
/// the square root of error and rounding wide.
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
