#include "bench/peers/overlap.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

namespace skerry::peers {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Interval {
  double low = kInfinity, high = -kInfinity;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// `b` seen from the frame of `a`.
Pose relative(const Pose& a, const Pose& b) {
  const Quat back = a.orientation.conjugate();
  return {back * (b.position - a.position), back * b.orientation};
}

// ---- polyhedron and polyhedron -----------------------------------------------------------------

Interval project(const std::vector<Vec3>& points, const Vec3& axis) {
  Interval interval;
  for (const Vec3& p : points) interval.add(axis.dot(p));
  return interval;
}

// The least overlap of the two over the axes tried; stops at the first that parts them.
class AxisSearch {
 public:
  AxisSearch(const Polyhedron& a, const Polyhedron& b, const Pose& b_in_a)
      : a_(a), b_(b), turn_(b_in_a.orientation.toRotationMatrix()) {
    for (const Vec3& p : b.points) points_b_.push_back(turn_ * p + b_in_a.position);
    for (const Vec3& e : b.edges) edges_b_.push_back(turn_ * e);
  }

  double run() {
    for (const Vec3& n : a_.normals) {
      if (parts(n)) return depth_;
    }
    for (const Vec3& n : b_.normals) {
      if (parts(turn_ * n)) return depth_;
    }
    for (const Vec3& ea : a_.edges) {
      for (const Vec3& eb : edges_b_) {
        const Vec3 axis = ea.cross(eb);
        const double length = axis.norm();
        // Edges nearly parallel: the axis adds nothing to the faces' own.
        if (length > 1e-6 && parts(axis / length)) return depth_;
      }
    }
    return depth_;
  }

 private:
  bool parts(const Vec3& axis) {
    const Interval a = project(a_.points, axis);
    const Interval b = project(points_b_, axis);
    depth_ = std::min({depth_, a.high - b.low, b.high - a.low});
    return depth_ <= 0;
  }

  const Polyhedron& a_;
  const Polyhedron& b_;
  Mat3 turn_;
  std::vector<Vec3> points_b_, edges_b_;
  double depth_ = kInfinity;
};

// ---- sphere and the others ---------------------------------------------------------------------

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double t = std::clamp(ab.dot(p - a) / ab.squaredNorm(), 0.0, 1.0);
  return (p - (a + t * ab)).norm();
}

// For a point on the outer side of the face's plane.
double distance_to_face(const Vec3& p, const Polyhedron& solid, const Face& face) {
  double nearest_edge = kInfinity;
  bool over_face = true;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    const Vec3& a = solid.points[face.corners[i]];
    const Vec3& b = solid.points[face.corners[(i + 1) % face.corners.size()]];
    if (face.normal.cross(b - a).dot(p - a) < 0) over_face = false;
    nearest_edge = std::min(nearest_edge, distance_to_segment(p, a, b));
  }
  return over_face ? face.normal.dot(p) - face.offset : nearest_edge;
}

// Negative inside.
double signed_distance(const Vec3& p, const Polyhedron& solid) {
  double inside = -kInfinity, outside = kInfinity;
  for (const Face& face : solid.faces) {
    const double height = face.normal.dot(p) - face.offset;
    inside = std::max(inside, height);
    if (height > 0) outside = std::min(outside, distance_to_face(p, solid, face));
  }
  return inside > 0 ? outside : inside;
}

// ---- sweep -------------------------------------------------------------------------------------

struct Bounds {
  Vec3 low, high;
  bool meets(const Bounds& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

Bounds bounds(const Placed& placed) {
  const Vec3& at = placed.pose.position;
  if (placed.shape->form == Form::sphere) {
    const Vec3 r = Vec3::Constant(placed.shape->radius);
    return {at - r, at + r};
  }
  Bounds box = {Vec3::Constant(kInfinity), Vec3::Constant(-kInfinity)};
  const Mat3 turn = placed.pose.orientation.toRotationMatrix();
  for (const Vec3& point : placed.shape->solid.points) {
    const Vec3 p = turn * point + at;
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box;
}

class Sweep {
 public:
  Sweep(const PeerScene& scene, std::span<const BodyState> states) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const PeerBody& body = scene.bodies[i];
      const Placed placed = {&scene.shapes[body.shape], states[i].pose};
      (body.fixed ? fixed_ : moving_).push_back({placed, bounds(placed)});
    }
    std::sort(moving_.begin(), moving_.end(),
              [](const Item& a, const Item& b) { return a.box.low.x() < b.box.low.x(); });
  }

  Penetration run() {
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      for (const Item& other : fixed_) test(moving_[i], other);
      for (std::size_t j = i + 1;
           j < moving_.size() && moving_[j].box.low.x() <= moving_[i].box.high.x(); ++j) {
        test(moving_[i], moving_[j]);
      }
    }
    if (result_.pairs > 0) result_.mean = sum_ / static_cast<double>(result_.pairs);
    return result_;
  }

 private:
  struct Item {
    Placed placed;
    Bounds box;
  };

  void test(const Item& a, const Item& b) {
    if (!a.box.meets(b.box)) return;
    const double depth = penetration(a.placed, b.placed);
    if (depth <= 0) return;
    ++result_.pairs;
    sum_ += depth;
    result_.max = std::max(result_.max, depth);
  }

  std::vector<Item> fixed_, moving_;
  Penetration result_;
  double sum_ = 0;
};

}  // namespace

double penetration(const Placed& a, const Placed& b) {
  const bool round_a = a.shape->form == Form::sphere;
  const bool round_b = b.shape->form == Form::sphere;
  if (round_a && round_b) {
    return a.shape->radius + b.shape->radius - (b.pose.position - a.pose.position).norm();
  }
  if (round_a) return penetration(b, a);
  const Pose b_in_a = relative(a.pose, b.pose);
  if (round_b) return b.shape->radius - signed_distance(b_in_a.position, a.shape->solid);
  return AxisSearch(a.shape->solid, b.shape->solid, b_in_a).run();
}

Penetration measure_penetration(const PeerScene& scene, std::span<const BodyState> states) {
  return Sweep(scene, states).run();
}

}  // namespace skerry::peers
