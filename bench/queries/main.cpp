// Single rays per second on 10,000 boxes above a mesh of 100,352 triangles: Skerry (one call a ray,
// and through a batch), Bullet, and brute force over all boxes and triangles. The casters take turns
// in blocks of rays, so that a machine that slows down does so for all; their answers are compared.
// Then batches of each kind, by one worker and by two.
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>

#include <skerry/world.h>

#include "bench/queries/ray_scene.h"
#include "scenes/geometry.h"

namespace skerry::bench {
namespace {

constexpr double kWidth = 120;  // m, of the ground
constexpr int kCells = 224;     // 2 * 224^2 = 100,352 triangles
constexpr int kBoxes = 10'000;

struct Random {
  std::uint64_t state = 88172645463325252ull;
  double operator()() {  // xorshift; uniform in [-1, 1)
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return double(state >> 11) * 0x1p-52 - 1;
  }
  Vec3 vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }
};

RayScene make_scene(Random& random) {
  RayScene scene;
  scene.ground = std::make_shared<MeshData>(scenes::wavy_ground(kCells, kWidth, 1.0, 0.0));
  for (int i = 0; i < kBoxes; ++i) {
    const Vec3 at = random.vector();
    const Quat turn = Quat{1.2, random(), random(), random()}.normalized();
    scene.boxes.push_back({{at.x() * 55, 12 + 10 * at.y(), at.z() * 55}, turn});
  }
  return scene;
}

// What games and sensors ask: looking around from among the boxes, down from above, level from afar.
std::vector<RayCast> make_rays(Random& random, const std::string& kind, int count) {
  std::vector<RayCast> rays;
  for (int i = 0; i < count; ++i) {
    const Vec3 at = random.vector(), to = random.vector();
    if (kind == "around")
      rays.push_back({{at.x() * 50, 12 + 10 * at.y(), at.z() * 50}, to.normalized() * 60});
    else if (kind == "down")
      rays.push_back({{at.x() * 55, 40, at.z() * 55}, {to.x(), -60, to.z()}});
    else
      rays.push_back({{-80, 12 + 10 * at.y(), at.z() * 55}, {160, 10 * to.y(), 60 * to.z()}});
  }
  return rays;
}

class SkerryCaster final : public RayCaster {
 public:
  explicit SkerryCaster(const RayScene& scene, WorldSettings settings = {}) : world_(settings) {
    world_.add_body({.type = BodyType::fixed, .shapes = {TriangleMesh{scene.ground}}});
    for (const Pose& pose : scene.boxes)
      world_.add_body(
          {.shapes = {Box{}}, .position = pose.position, .orientation = pose.orientation});
    world_.queries();
  }
  double cast(const RayCast& ray) override {
    const auto hit = world_.ray_cast(ray);
    return hit ? hit->fraction : 2;
  }
  const World& world() const { return world_; }

 private:
  World world_;
};

class BruteForce final : public RayCaster {
 public:
  explicit BruteForce(const RayScene& scene) : scene_(scene) {}
  double cast(const RayCast& ray) override {
    double best = 2;
    for (const Pose& pose : scene_.boxes) best = std::min(best, box(pose, ray));
    const auto& v = scene_.ground->vertices;
    for (const auto& t : scene_.ground->triangles)
      best = std::min(best, triangle(v[t[0]], v[t[1]], v[t[2]], ray));
    return best;
  }

 private:
  static double box(const Pose& pose, const RayCast& ray) {
    const Vec3 o = pose.orientation.conjugate() * (ray.origin - pose.position);
    const Vec3 d = pose.orientation.conjugate() * ray.translation;
    double in = 0, out = 1;
    for (int i = 0; i < 3; ++i) {
      const double t0 = (-0.5 - o[i]) / d[i], t1 = (0.5 - o[i]) / d[i];
      in = std::max(in, std::min(t0, t1));
      out = std::min(out, std::max(t0, t1));
    }
    return in <= out ? in : 2;
  }
  static double triangle(const Vec3& a, const Vec3& b, const Vec3& c, const RayCast& ray) {
    const Vec3 e1 = b - a, e2 = c - a, p = ray.translation.cross(e2);
    const double det = e1.dot(p);
    if (det == 0) return 2;
    const Vec3 s = ray.origin - a, q = s.cross(e1);
    const double u = s.dot(p) / det, w = ray.translation.dot(q) / det, t = e2.dot(q) / det;
    return u >= 0 && w >= 0 && u + w <= 1 && t >= 0 && t <= 1 ? t : 2;
  }
  const RayScene& scene_;
};

double seconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

struct Row {
  std::string name;
  std::function<void(std::size_t first, std::size_t last, std::vector<double>& out)> cast;
  std::size_t rays = 0;  // of those given; brute force takes fewer
  double time = 0;
  std::vector<double> fractions = {};
};

void race(const std::string& kind, const std::vector<RayCast>& rays, std::vector<Row>& rows) {
  constexpr std::size_t kBlock = 1000;
  for (Row& row : rows) {
    row.fractions.assign(rays.size(), -1);
    row.time = 0;
  }
  for (std::size_t first = 0; first < rays.size(); first += kBlock)
    for (std::size_t turn = 0; turn < rows.size(); ++turn) {
      // Whoever comes first brings the scene into the cache for the rest.
      Row& row = rows[(turn + first / kBlock) % rows.size()];
      const std::size_t last = std::min({first + kBlock, rays.size(), row.rays});
      if (first < last) row.time += seconds([&] { row.cast(first, last, row.fractions); });
    }
  for (const Row& row : rows) {
    std::size_t differ = 0, hits = 0;
    for (std::size_t i = 0; i < row.rays; ++i) {
      hits += row.fractions[i] <= 1;
      const double other = rows[0].fractions[i];
      differ += (other <= 1) != (row.fractions[i] <= 1) ||
                (other <= 1 && std::abs(other - row.fractions[i]) > 1e-3);
    }
    const double own = row.time / double(row.rays), ours = rows[0].time / double(rows[0].rays);
    fmt::print(
        "{:<8} {:<16} {:>10.0f} ns/ray {:>12.0f} rays/s  x{:<9.2f} hits {:>5.1f} %  differ {}\n",
        kind, row.name, 1e9 * own, 1 / own, ours / own, 100.0 * double(hits) / double(row.rays),
        differ);
  }
}

// Batches of 2,000 by one worker and by two in turn; the least time of each batch counts.
template <class Query, class Ask>
void race_batches(const char* name, const std::vector<Query>& queries, const World& one,
                  const World& two, const Ask& ask) {
  constexpr std::size_t kBatch = 2000;
  constexpr int kRounds = 5;
  const World* const worlds[] = {&one, &two};
  double time[2] = {};
  for (std::size_t first = 0; first + kBatch <= queries.size(); first += kBatch) {
    const std::span<const Query> batch = std::span(queries).subspan(first, kBatch);
    double least[2] = {1e9, 1e9};
    for (int round = 0; round < kRounds; ++round)
      for (int i = 0; i < 2; ++i)
        least[i] = std::min(least[i], seconds([&] { ask(*worlds[i], batch); }));
    for (int i = 0; i < 2; ++i) time[i] += least[i];
  }
  const auto count = double(queries.size() / kBatch * kBatch);
  fmt::print("{:<12} 1 worker {:>8.0f} ns each, 2 workers {:>8.0f}: x{:.2f}\n", name,
             1e9 * time[0] / count, 1e9 * time[1] / count, time[0] / time[1]);
}

void run_batches(Random& random, const World& one, const World& two) {
  const std::vector<RayCast> rays = make_rays(random, "around", 20'000);
  std::vector<ShapeCast> casts;
  std::vector<PlacedShape> places;
  std::vector<Vec3> points;
  const QueryShape capsule(Capsule{.radius = 0.3, .half_height = 0.6});
  const QueryShape ball(Sphere{.radius = 3});
  for (const RayCast& ray : rays) {
    casts.push_back({capsule, {.position = ray.origin}, ray.translation / 10});
    places.push_back({ball, {.position = ray.origin}});
    points.push_back(ray.origin);
  }
  race_batches("rays", rays, one, two,
               [](const World& world, auto batch) { return world.ray_cast_batch(batch).size(); });
  race_batches("casts", casts, one, two,
               [](const World& world, auto batch) { return world.shape_cast_batch(batch).size(); });
  race_batches("overlaps", places, one, two,
               [](const World& world, auto batch) { return world.overlap_batch(batch).size(); });
  race_batches("closest", points, one, two,
               [](const World& world, auto batch) { return world.closest_batch(batch, 5).size(); });
}

int run_queries() {
  Random random;
  const RayScene scene = make_scene(random);
  SkerryCaster single(scene);
  SkerryCaster serial(scene), parallel(scene, {.mode = ThreadingMode::job_system, .workers = 2});
  BruteForce brute(scene);
  const QueryView view = single.world().queries();
#if SKERRY_HAVE_BULLET
  const auto bullet = make_bullet_caster(scene);
#endif
  fmt::print("{} boxes, {} triangles\n", kBoxes, scene.ground->triangles.size());
  for (const std::string kind : {"around", "down", "level"}) {
    const std::vector<RayCast> rays = make_rays(random, kind, 20'000);
    std::vector<Row> rows;
    const auto add = [&](const char* name, std::size_t count, RayCaster& caster) {
      rows.push_back({name,
                      [&](std::size_t first, std::size_t last, std::vector<double>& out) {
                        for (std::size_t i = first; i < last; ++i) out[i] = caster.cast(rays[i]);
                      },
                      count});
    };
    const auto add_batch = [&](const char* name, const SkerryCaster& caster) {
      rows.push_back({name,
                      [&](std::size_t first, std::size_t last, std::vector<double>& out) {
                        const auto hits = caster.world().ray_cast_batch(
                            std::span(rays).subspan(first, last - first));
                        for (std::size_t i = first; i < last; ++i)
                          out[i] = hits[i - first] ? hits[i - first]->fraction : 2;
                      },
                      rays.size()});
    };
    add("skerry", rays.size(), single);
    rows.push_back({"skerry, view",
                    [&](std::size_t first, std::size_t last, std::vector<double>& out) {
                      for (std::size_t i = first; i < last; ++i) {
                        const auto hit = view.ray_cast(rays[i]);
                        out[i] = hit ? hit->fraction : 2;
                      }
                    },
                    rays.size()});
    add_batch("skerry, batch", serial);
    add_batch("skerry, batch x2", parallel);
#if SKERRY_HAVE_BULLET
    add("bullet", rays.size(), *bullet);
#endif
    add("brute force", 200, brute);
    race(kind, rays, rows);
  }
  run_batches(random, serial.world(), parallel.world());
  return 0;
}

}  // namespace
}  // namespace skerry::bench

int main() { return skerry::bench::run_queries(); }
