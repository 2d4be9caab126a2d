// Bullet's closest-hit ray test: dynamic bounding-volume broadphase, quantised mesh tree, single
// precision, as its users get it.
#include <btBulletCollisionCommon.h>

#include "bench/queries/ray_scene.h"

namespace skerry::bench {
namespace {

btVector3 to_bullet(const Vec3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

class BulletCaster final : public RayCaster {
 public:
  explicit BulletCaster(const RayScene& scene) {
    for (const auto& t : scene.ground->triangles) {
      const auto& v = scene.ground->vertices;
      triangles_.addTriangle(to_bullet(v[t[0]]), to_bullet(v[t[1]]), to_bullet(v[t[2]]));
    }
    ground_ = std::make_unique<btBvhTriangleMeshShape>(&triangles_, true);
    add(*ground_, btTransform::getIdentity());
    for (const Pose& pose : scene.boxes) {
      const Quat& q = pose.orientation;
      add(box_,
          btTransform(btQuaternion(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                   static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())),
                      to_bullet(pose.position)));
    }
    world_.updateAabbs();
    broadphase_.optimize();
  }
  ~BulletCaster() override {
    for (const auto& object : objects_) world_.removeCollisionObject(object.get());
  }

  double cast(const RayCast& ray) override {
    const btVector3 from = to_bullet(ray.origin), to = to_bullet(ray.origin + ray.translation);
    btCollisionWorld::ClosestRayResultCallback nearest(from, to);
    world_.rayTest(from, to, nearest);
    return nearest.hasHit() ? static_cast<double>(nearest.m_closestHitFraction) : 2;
  }

 private:
  void add(btCollisionShape& shape, const btTransform& place) {
    auto object = std::make_unique<btCollisionObject>();
    object->setCollisionShape(&shape);
    object->setWorldTransform(place);
    world_.addCollisionObject(object.get());
    objects_.push_back(std::move(object));
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_{&dispatcher_, &broadphase_, &configuration_};
  btTriangleMesh triangles_;
  std::unique_ptr<btBvhTriangleMeshShape> ground_;
  btBoxShape box_{btVector3(0.5f, 0.5f, 0.5f)};
  std::vector<std::unique_ptr<btCollisionObject>> objects_;
};

}  // namespace

std::unique_ptr<RayCaster> make_bullet_caster(const RayScene& scene) {
  return std::make_unique<BulletCaster>(scene);
}

}  // namespace skerry::bench
