// Checks at the API edge. Each throws InputError naming the field and the value.
#pragma once

#include <string>

#include <skerry/body.h>
#include <skerry/commands.h>
#include <skerry/joints.h>
#include <skerry/queries.h>
#include <skerry/settings.h>

#include "core/mass_properties.h"

namespace skerry::pipeline {

void check_finite(const std::string& field, double value);
void check_finite(const std::string& field, const Vec3& value);
// Finite and > 0.
void check_positive(const std::string& field, double value);
// Finite and >= 0.
void check_not_negative(const std::string& field, double value);
// Between 0 and 1e6: converted to float and multiplied with impulses.
void check_coefficient(const std::string& field, double value);
// 0, or between 1e-9 and 1e9 Hz: squares and inverses stay finite.
void check_frequency(const std::string& field, double value);
// At most 1e12 m from the origin: a double there still tells 0.1 mm apart.
void check_position(const std::string& field, const Vec3& value);
// A velocity or acceleration, per second: at most 1e9 m or rad. Its square is far from the end of float.
void check_rate(const std::string& field, const Vec3& value);
// What an impulse makes of a body's velocities: rates, as above.
void check_impulse(const Vec3& impulse, const Vec3& linear, const Vec3& angular);
// Between 1e-20 and 1e30 kg: the inverse is a float.
void check_mass(const std::string& field, double value);
// A length of a shape: between a micrometre and 10,000 km, the range that single precision kernels
// can tell apart.
void check_length(const std::string& field, double value);
// Unit to 1e-3.
void check_rotation(const std::string& field, const Quat& value);
void check_pose(const std::string& field, const Pose& pose);
void check_unit(const std::string& field, const Vec3& value);

void check_settings(const WorldSettings& settings);
void check_body_type(BodyType type);
// Everything about a body that can be said without building its geometry.
void check_body(const BodyDesc& body);
// Whether a body may be dynamic with this mass; an inertia that the user gave is checked too.
void check_dynamic_mass(const core::MassProperties& mass, bool given);
void check_material(const std::string& field, const Material& material);
// s, between 1e-6 and 1.
void check_time_step(double dt);
// The values in a command, not whether its body exists.
void check_command(const Command& command);

// What queries are given.
void check_query_point(const std::string& field, const Vec3& point);
void check_query_pose(const std::string& field, const Pose& pose);
void check_max_distance(double max_distance);
void check_ray(const RayCast& ray);
void check_cast(const ShapeCast& cast);
void check_query_shape(const Shape& shape);

}  // namespace skerry::pipeline
