// Bullet as its users get it: one thread, single precision, dbvt broadphase, sequential impulses
// with 10 iterations, warm starting and split impulse, all of which are its defaults.
#include <btBulletDynamicsCommon.h>

#include <LinearMath/btConvexHullComputer.h>
#include <algorithm>
#include <cmath>

#include "bench/peers/engine.h"

namespace skerry::peers {
namespace {

constexpr int kIterations = 10;

btVector3 to_bullet(const Vec3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
btTransform to_bullet(const Pose& pose) {
  const Quat& q = pose.orientation;
  const btQuaternion turn(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                          static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w()));
  return btTransform(turn, to_bullet(pose.position));
}
Vec3 from_bullet(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}
Pose from_bullet(const btTransform& transform) {
  const btQuaternion q = transform.getRotation();
  const Quat turn(static_cast<double>(q.w()), static_cast<double>(q.x()),
                  static_cast<double>(q.y()), static_cast<double>(q.z()));
  return {from_bullet(transform.getOrigin()), turn.normalized()};
}

// Bullet keeps its margin outside the hull it is given, so that hull is made smaller by as much;
// boxes and spheres have their margin inside already.
std::unique_ptr<btCollisionShape> shrunk_hull(const Polyhedron& solid) {
  std::vector<double> coordinates;
  for (const Vec3& p : solid.points) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  btConvexHullComputer computer;
  computer.compute(coordinates.data(), 3 * sizeof(double), static_cast<int>(solid.points.size()),
                   CONVEX_DISTANCE_MARGIN, 0);
  auto hull = std::make_unique<btConvexHullShape>();
  for (int i = 0; i < computer.vertices.size(); ++i) hull->addPoint(computer.vertices[i], false);
  hull->recalcLocalAabb();
  hull->setMargin(CONVEX_DISTANCE_MARGIN);
  return hull;
}

std::unique_ptr<btCollisionShape> make_shape(const PeerShape& shape) {
  switch (shape.form) {
    case Form::box:
      return std::make_unique<btBoxShape>(to_bullet(shape.half_extents));
    case Form::sphere:
      return std::make_unique<btSphereShape>(static_cast<btScalar>(shape.radius));
    case Form::hull:
      break;
  }
  return shrunk_hull(shape.solid);
}

class Bullet : public Engine {
 public:
  ~Bullet() override {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  void build(const PeerScene& scene) override {
    dt_ = static_cast<btScalar>(scene.source.defaults.dt);
    world_.setGravity(to_bullet(scene.source.defaults.gravity));
    world_.getSolverInfo().m_numIterations = kIterations;
    for (const PeerShape& shape : scene.shapes) shapes_.push_back(make_shape(shape));
    for (const PeerBody& body : scene.bodies) add_body(body);
  }

  void step() override { world_.stepSimulation(dt_, 0); }

  std::vector<BodyState> states() override {
    std::vector<BodyState> states;
    for (const auto& body : bodies_) {
      states.push_back({from_bullet(body->getWorldTransform()),
                        from_bullet(body->getLinearVelocity()),
                        from_bullet(body->getAngularVelocity())});
    }
    return states;
  }

 private:
  void add_body(const PeerBody& peer) {
    btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(peer.mass), nullptr,
                                                  shapes_[peer.shape].get(),
                                                  to_bullet(peer.inertia));
    info.m_startWorldTransform = to_bullet(peer.pose);
    info.m_friction = static_cast<btScalar>(std::sqrt(peer.friction));  // Bullet multiplies the two
    info.m_restitution = 0;
    auto body = std::make_unique<btRigidBody>(info);
    body->setLinearVelocity(to_bullet(peer.linear_velocity));
    body->setAngularVelocity(to_bullet(peer.angular_velocity));
    if (!peer.fixed) body->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(body.get());
    bodies_.push_back(std::move(body));
  }

  btScalar dt_ = 0;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace

std::unique_ptr<Engine> make_bullet() { return std::make_unique<Bullet>(); }

EngineInfo bullet_info() {
  const int version = btGetVersion();
  return {.name = "bullet",
          .version = std::to_string(version / 100) + "." + std::to_string(version % 100),
          .settings =
              "single precision, dbvt broadphase, 10 iterations, stepSimulation(dt, 0), "
              "hulls shrunk by the 0.04 m margin, sqrt(friction) per body, "
              "DISABLE_DEACTIVATION"};
}

}  // namespace skerry::peers
