#include <skerry/skerry.h>
#include <cstdio>

int main() {
  skerry::World world({.gravity = {0, -9.81, 0}});
  world.add_body({.type = skerry::BodyType::fixed,
                  .shapes = {skerry::Box{.half_extents = {50, 1, 50}}},
                  .position = {0, -1, 0}});
  const skerry::BodyId ball = world.add_body(
      {.shapes = {skerry::Sphere{.radius = 0.5}}, .position = {0, 4, 0}, .restitution = 0.5});
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  std::printf("y = %.3f m\n", world.pose(ball).position.y());
}
