// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/roots/parameter_box.hpp>

namespace patchrt::detail {

/// Boxes that could not be decided: those that touch are one.
template <class R> class root_clusters {
 public:
  struct cluster {
    parameter_box<R> box;
    bool is_unfinished;  ///< more steps might have said more
  };

  /// Boxes of one contact may have been contracted apart: gaps of half a box count as touching.
  PATCHRT_HD void add(parameter_box<R> const& box, bool is_unfinished) {
    R const slack_u = (box.u_high - box.u_low) / R(2), slack_v = (box.v_high - box.v_low) / R(2);
    int at = 0;
    while (at < count_ && !is_touching(items_[at].box, box, slack_u, slack_v)) ++at;
    if (at == capacity) {
      join(items_[capacity - 1], {box, true});
    } else if (at == count_) {
      items_[count_++] = {box, is_unfinished};
    } else {
      join(items_[at], {box, is_unfinished});
    }
  }

  /// Joins what has come to touch while it grew, and leaves `most` at most.
  PATCHRT_HD void settle(int most) {
    for (int i = 0; i < count_; ++i) {
      for (int k = i + 1; k < count_; ++k) {
        if (!is_touching(items_[i].box, items_[k].box)) continue;
        join(items_[i], items_[k]);
        remove(k);
        i = -1;
        break;
      }
    }
    for (; count_ > most; --count_) {
      join(items_[most - 1], items_[count_ - 1]);
      items_[most - 1].is_unfinished = true;
    }
  }

  PATCHRT_HD void remove(int k) { items_[k] = items_[--count_]; }
  PATCHRT_HD int count() const { return count_; }
  PATCHRT_HD cluster const& operator[](int k) const { return items_[k]; }

 private:
  static constexpr int capacity = 32;
  cluster items_[capacity];
  int count_ = 0;

  PATCHRT_HD static void join(cluster& a, cluster const& b) {
    a.box = {min(a.box.u_low, b.box.u_low), max(a.box.u_high, b.box.u_high), min(a.box.v_low, b.box.v_low),
             max(a.box.v_high, b.box.v_high)};
    a.is_unfinished = a.is_unfinished || b.is_unfinished;
  }
};

/// Boxes to be looked at, first in, first out.
template <class R, int Capacity> class box_queue {
 public:
  PATCHRT_HD bool is_empty() const { return count_ == 0; }
  PATCHRT_HD int room() const { return Capacity - count_; }
  PATCHRT_HD void push(parameter_box<R> const& box) { items_[(first_ + count_++) % Capacity] = box; }
  PATCHRT_HD parameter_box<R> pop() {
    parameter_box<R> const box = items_[first_];
    first_ = (first_ + 1) % Capacity;
    --count_;
    return box;
  }

 private:
  parameter_box<R> items_[Capacity];
  int first_ = 0;
  int count_ = 0;
};

}  // namespace patchrt::detail
