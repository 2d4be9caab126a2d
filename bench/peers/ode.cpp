// ODE with the iterative stepper and friction proportional to the normal force. All else is as ODE
// has it when nothing is set: ERP 0.2, no surface layer, no auto-disabling.
#include <ode/ode.h>
#include <array>
#include <cmath>

#include "bench/peers/engine.h"

namespace skerry::peers {
namespace {

constexpr int kIterations = 20;
constexpr int kMaxContacts = 8;                   // per pair
constexpr unsigned long kFixed = 1, kMoving = 2;  // collision categories

// ODE keeps pointers to all of this.
struct OdeHull {
  explicit OdeHull(const Polyhedron& solid) {
    for (const Vec3& p : solid.points) points.insert(points.end(), {p.x(), p.y(), p.z()});
    for (const Face& face : solid.faces) {
      const Vec3& n = face.normal;
      planes.insert(planes.end(), {n.x(), n.y(), n.z(), face.offset});
      polygons.push_back(static_cast<unsigned>(face.corners.size()));
      polygons.insert(polygons.end(), face.corners.begin(), face.corners.end());
    }
  }
  unsigned point_count() const { return static_cast<unsigned>(points.size() / 3); }
  unsigned plane_count() const { return static_cast<unsigned>(planes.size() / 4); }

  std::vector<dReal> points, planes;
  std::vector<unsigned> polygons;
};

struct Library {
  Library() { dInitODE2(0); }
  ~Library() { dCloseODE(); }
};

void make_library_ready() { static const Library library; }

dSpaceID make_space(OdeSpace kind) {
  make_library_ready();
  if (kind == OdeSpace::sweep_and_prune) return dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XZY);
  const dSpaceID space = dHashSpaceCreate(nullptr);
  dHashSpaceSetLevels(space, -1, 4);  // cells of 0.5 to 16 m; larger bodies are tried with all
  return space;
}

void place(dGeomID geom, const Pose& pose) {
  const Quat& q = pose.orientation;
  const dQuaternion turn = {q.w(), q.x(), q.y(), q.z()};
  dGeomSetPosition(geom, pose.position.x(), pose.position.y(), pose.position.z());
  dGeomSetQuaternion(geom, turn);
}

class Ode : public Engine {
 public:
  explicit Ode(OdeSpace kind)
      : space_(make_space(kind)), world_(dWorldCreate()), contacts_(dJointGroupCreate(0)) {}

  ~Ode() override {
    dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
    dSpaceDestroy(space_);
  }

  void build(const PeerScene& scene) override {
    dt_ = scene.source.defaults.dt;
    const Vec3& gravity = scene.source.defaults.gravity;
    dRandSetSeed(0);  // the stepper shuffles its constraints
    dWorldSetGravity(world_, gravity.x(), gravity.y(), gravity.z());
    dWorldSetQuickStepNumIterations(world_, kIterations);
    dWorldSetAutoDisableFlag(world_, 0);
    for (const PeerShape& shape : scene.shapes) hulls_.emplace_back(shape.solid);
    friction_.reserve(scene.bodies.size());  // geoms keep pointers into it
    for (const PeerBody& body : scene.bodies) add_body(body, scene.shapes[body.shape]);
  }

  void step() override {
    dSpaceCollide(space_, this,
                  [](void* self, dGeomID a, dGeomID b) { static_cast<Ode*>(self)->collide(a, b); });
    dWorldQuickStep(world_, dt_);
    dJointGroupEmpty(contacts_);
  }

  std::vector<BodyState> states() override {
    std::vector<BodyState> states;
    for (const dGeomID geom : geoms_) states.push_back(state(geom));
    return states;
  }

 private:
  dGeomID make_geom(const PeerShape& shape, OdeHull& hull) {
    const Vec3 side = 2 * shape.half_extents;
    switch (shape.form) {
      case Form::box:
        return dCreateBox(space_, side.x(), side.y(), side.z());
      case Form::sphere:
        return dCreateSphere(space_, shape.radius);
      case Form::hull:
        break;
    }
    return dCreateConvex(space_, hull.planes.data(), hull.plane_count(), hull.points.data(),
                         hull.point_count(), hull.polygons.data());
  }

  void add_body(const PeerBody& peer, const PeerShape& shape) {
    const dGeomID geom = make_geom(shape, hulls_[peer.shape]);
    friction_.push_back(peer.friction);
    dGeomSetData(geom, &friction_.back());
    dGeomSetCategoryBits(geom, peer.fixed ? kFixed : kMoving);
    dGeomSetCollideBits(geom, peer.fixed ? kMoving : kFixed | kMoving);
    if (!peer.fixed) dGeomSetBody(geom, make_body(peer));
    place(geom, peer.pose);
    geoms_.push_back(geom);
  }

  dBodyID make_body(const PeerBody& peer) {
    dMass mass;
    dMassSetParameters(&mass, peer.mass, 0, 0, 0, peer.inertia.x(), peer.inertia.y(),
                       peer.inertia.z(), 0, 0, 0);
    const dBodyID body = dBodyCreate(world_);
    dBodySetMass(body, &mass);
    const Vec3& v = peer.linear_velocity;
    const Vec3& w = peer.angular_velocity;
    dBodySetLinearVel(body, v.x(), v.y(), v.z());
    dBodySetAngularVel(body, w.x(), w.y(), w.z());
    return body;
  }

  void collide(dGeomID a, dGeomID b) {
    std::array<dContact, kMaxContacts> found;
    const int count = dCollide(a, b, kMaxContacts, &found[0].geom, sizeof(dContact));
    if (count == 0) return;
    dSurfaceParameters surface = {};
    surface.mode = dContactApprox1;  // without it mu would be a force in newtons
    surface.mu =
        std::sqrt(*static_cast<double*>(dGeomGetData(a)) * *static_cast<double*>(dGeomGetData(b)));
    for (int i = 0; i < count; ++i) {
      found[static_cast<std::size_t>(i)].surface = surface;
      const dJointID joint =
          dJointCreateContact(world_, contacts_, &found[static_cast<std::size_t>(i)]);
      dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    }
  }

  static BodyState state(dGeomID geom) {
    const dReal* p = dGeomGetPosition(geom);
    dQuaternion q;
    dGeomGetQuaternion(geom, q);
    BodyState state = {.pose = {{p[0], p[1], p[2]}, Quat(q[0], q[1], q[2], q[3]).normalized()}};
    if (const dBodyID body = dGeomGetBody(geom)) {
      const dReal* v = dBodyGetLinearVel(body);
      const dReal* w = dBodyGetAngularVel(body);
      state.linear_velocity = {v[0], v[1], v[2]};
      state.angular_velocity = {w[0], w[1], w[2]};
    }
    return state;
  }

  double dt_ = 0;
  dSpaceID space_;
  dWorldID world_;
  dJointGroupID contacts_;
  std::vector<OdeHull> hulls_;  // [shape]
  std::vector<double> friction_;
  std::vector<dGeomID> geoms_;
};

}  // namespace

std::unique_ptr<Engine> make_ode(OdeSpace space) { return std::make_unique<Ode>(space); }

EngineInfo ode_info(OdeSpace space) {
  return {.name = "ode",
          .version = dODE_VERSION,
          .settings = std::string(sizeof(dReal) == 8 ? "double" : "single") + " precision, " +
                      (space == OdeSpace::hash ? "hash" : "sweep-and-prune") +
                      " space, dWorldQuickStep, 20 iterations, at most 8 contacts per pair, "
                      "dContactApprox1"};
}

}  // namespace skerry::peers
