// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/map_projection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <dlfcn.h>
#include <fmt/format.h>
#include <proj.h>
#include <proj_experimental.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::cloud {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Differences for derivatives: third derivatives of a map are about 1/R^2, so that steps of this
/// length leave 1e-10 of a derivative, and the last digit of a coordinate 1e-11.
constexpr double kStep = 100;  // m

struct FreeObject {
  void operator()(PJ* object) const { proj_destroy(object); }
};
struct FreeContext {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
using Object = std::unique_ptr<PJ, FreeObject>;
using Context = std::unique_ptr<PJ_CONTEXT, FreeContext>;

/// Makes the library use the data installed beside it, as in a wheel: its database must match its
/// version, and PROJ_DATA may belong to another program's library. Grids may still lie there.
void use_own_data(PJ_CONTEXT* context) {
  Dl_info library;
  if (dladdr(reinterpret_cast<const void*>(&proj_context_create), &library) == 0) return;
  const std::filesystem::path folder =
      std::filesystem::path(library.dli_fname).parent_path().parent_path() / "share" / "proj";
  std::error_code none;
  if (!std::filesystem::exists(folder / "proj.db", none)) return;
  std::vector<std::string> folders = {folder.string()};
  const char* given = std::getenv("PROJ_DATA");
  std::istringstream others(given == nullptr ? "" : given);
  for (std::string other; std::getline(others, other, ':');) folders.push_back(other);
  std::vector<const char*> names;
  names.reserve(folders.size());
  for (const std::string& name : folders) names.push_back(name.c_str());
  proj_context_set_search_paths(context, static_cast<int>(names.size()), names.data());
}

/// The library's last message, instead of its printing it.
void keep_message(void* where, int /*level*/, const char* message) {
  *static_cast<std::string*>(where) = message;
}

PJ_TYPE type_of(PJ_CONTEXT* context, const PJ* crs) {
  const PJ_TYPE type = proj_get_type(crs);
  if (type != PJ_TYPE_BOUND_CRS) return type;
  const Object inner(proj_get_source_crs(context, crs));
  return inner ? proj_get_type(inner.get()) : type;
}

/// Part of a compound system, or nothing.
Object part_of(PJ_CONTEXT* context, const PJ* crs, int index) {
  if (proj_get_type(crs) != PJ_TYPE_COMPOUND_CRS) return {};
  return Object(proj_crs_get_sub_crs(context, crs, index));
}

/// Whether all axes of a system are in metres; otherwise names the first other unit.
bool in_metres(PJ_CONTEXT* context, const PJ* crs, std::string& unit) {
  const Object system(proj_crs_get_coordinate_system(context, crs));
  if (!system) return false;
  const int axes = proj_cs_get_axis_count(context, system.get());
  for (int axis = 0; axis < axes; ++axis) {
    double factor = 0;
    const char* name = nullptr;
    if (proj_cs_get_axis_info(context, system.get(), axis, nullptr, nullptr, nullptr, &factor,
                              &name, nullptr, nullptr) == 0) {
      return false;
    }
    if (factor != 1 || std::string(name) != "metre") {
      unit = name;
      return false;
    }
  }
  return true;
}

std::optional<AreaOfUse> area_of(PJ_CONTEXT* context, const PJ* crs) {
  double west = 0, south = 0, east = 0, north = 0;
  const char* name = nullptr;
  constexpr double kUnknown = -999;  // below it the library knows no place
  if (proj_get_area_of_use(context, crs, &west, &south, &east, &north, &name) == 0 ||
      west < kUnknown + 1) {
    return std::nullopt;
  }
  // The first sentence: lists of countries follow.
  std::string words = name == nullptr ? "" : name;
  words.resize(std::min(words.size(), words.find(". ")));
  if (words.ends_with('.')) words.pop_back();
  return AreaOfUse{std::move(words), radians_from_degrees(west), radians_from_degrees(south),
                   radians_from_degrees(east), radians_from_degrees(north)};
}

/// A geographic or geocentric system as a geocentric one of the same datum.
Object geocentric_of(PJ_CONTEXT* context, const PJ* system) {
  if (type_of(context, system) == PJ_TYPE_GEOCENTRIC_CRS) {
    return Object(proj_clone(context, system));
  }
  const Object datum(proj_crs_get_datum(context, system));
  const Object ensemble(datum ? nullptr : proj_crs_get_datum_ensemble(context, system));
  const PJ* of = datum ? datum.get() : ensemble.get();
  if (of == nullptr) return {};
  return Object(
      proj_create_geocentric_crs_from_datum(context, proj_get_name(system), of, "metre", 1.0));
}

/// The missing grids needed for the best transformations between two systems, and their sources;
/// empty if no grid would help.
std::string missing_grids(PJ_CONTEXT* context, const PJ* from, const PJ* to) {
  struct FreeFactory {
    void operator()(PJ_OPERATION_FACTORY_CONTEXT* one) const {
      proj_operation_factory_context_destroy(one);
    }
  };
  struct FreeList {
    void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
  };
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, FreeFactory> factory(
      proj_create_operation_factory_context(context, nullptr));
  if (!factory) return {};
  proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(),
                                                           PROJ_GRID_AVAILABILITY_IGNORED);
  proj_operation_factory_context_set_allow_ballpark_transformations(context, factory.get(), 0);
  const std::unique_ptr<PJ_OBJ_LIST, FreeList> ways(
      proj_create_operations(context, from, to, factory.get()));
  std::string words;
  for (int i = 0; ways && i < proj_list_get_count(ways.get()) && words.empty(); ++i) {
    const Object way(proj_list_get(context, ways.get(), i));
    const int grids = way ? proj_coordoperation_get_grid_used_count(context, way.get()) : 0;
    for (int k = 0; k < grids; ++k) {
      const char *name = nullptr, *url = nullptr;
      int available = 1;
      proj_coordoperation_get_grid_used(context, way.get(), k, &name, nullptr, nullptr, &url,
                                        nullptr, nullptr, &available);
      if (available != 0 || name == nullptr) continue;
      words += words.empty() ? "the grid " : " and ";
      if (url == nullptr || *url == '\0') {
        words += fmt::format(
            "{} (PROJ {} does not know where to get it; later versions may: as a GeoTIFF it is "
            "read under this name, too)",
            name, proj_info().version);
      } else {
        words += fmt::format("{} (PROJ's projsync fetches it, or {})", name, url);
      }
    }
  }
  if (words.empty()) return {};
  const char* folder = proj_context_get_user_writable_directory(context, 0);
  return fmt::format(
      "{} is missing: PROJ looks for it in the folders of the variable PROJ_DATA and in {}; "
      "Debian's "
      "package proj-data has a few grids",
      words, folder == nullptr ? "its own" : folder);
}

Vector3d transformed(PJ* operation, PJ_DIRECTION direction, const Vector3d& place_m) {
  proj_errno_reset(operation);
  const PJ_COORD to =
      proj_trans(operation, direction, proj_coord(place_m.x(), place_m.y(), place_m.z(), HUGE_VAL));
  return {to.xyz.x, to.xyz.y, to.xyz.z};
}

}  // namespace

InvalidArgument GeographicSystem::at(double latitude, double longitude) const {
  return InvalidArgument(
      fmt::format("{}; the zone of this place (latitude {:.4f}, longitude {:.4f}) "
                  "is {}",
                  what(), degrees_from_radians(latitude), degrees_from_radians(longitude),
                  utm_zone_of(latitude, longitude, system_)));
}

double AreaOfUse::beyond(double latitude, double longitude) const {
  const double of_latitude = std::max({0.0, south - latitude, latitude - north});
  // Eastwards from the western edge; the rest of the circle is nearer to one edge or the other.
  const double width = wrap_to_two_pi(east - west), along = wrap_to_two_pi(longitude - west);
  const bool all_around = east - west > kTwoPi - 1e-9;
  const double of_longitude =
      all_around || along <= width ? 0.0 : std::min(along - width, kTwoPi - along);
  return std::max(of_latitude, of_longitude);
}

MapTangent::MapTangent(const Vector3d& center, const Vector3d& value, const Matrix3d& jacobian,
                       const std::array<Matrix3d, 3>& hessian)
    : center_(center), value_(value), jacobian_(jacobian) {
  for (std::size_t k = 0; k < 3; ++k) half_hessian_[k] = 0.5 * hessian[k];
}

Vector3d MapTangent::map(const Vector3d& point) const {
  const Vector3d d = point - center_;
  Vector3d bent;
  for (Eigen::Index k = 0; k < 3; ++k) {
    bent[k] = d.dot(half_hessian_[k] * d);
  }
  return value_ + (jacobian_ * d + bent);
}

struct MapProjection::State {
  std::string message;
  Context context;
  Object operation;
  std::string name, wkt;
  bool has_height_system = false;
  std::optional<AreaOfUse> area;
  std::mutex mutex;  // the library's objects serve one thread at a time
};

MapProjection::MapProjection(const std::string& crs, const std::string& source)
    : state_(std::make_unique<State>()) {
  state_->context.reset(proj_context_create());
  PJ_CONTEXT* context = state_->context.get();
  proj_log_func(context, &state_->message, keep_message);
  use_own_data(context);
  proj_context_set_enable_network(context, 0);  // results do not depend on a network connection
  const auto create = [&](const char* what, const std::string& text) {
    Object object(proj_create(context, text.c_str()));
    if (!object || proj_is_crs(object.get()) == 0) {
      throw InvalidArgument(
          fmt::format("{} = \"{}\" is not a coordinate reference system that PROJ knows: give an "
                      "EPSG code such as "
                      "EPSG:25832, with a height system EPSG:25832+7837, or WKT",
                      what, text));
    }
    return object;
  };
  const Object target = create("crs", crs);
  const Object horizontal = part_of(context, target.get(), 0);
  const Object vertical = part_of(context, target.get(), 1);
  const PJ* map = horizontal ? horizontal.get() : target.get();
  const std::string name = proj_get_name(target.get());
  const PJ_TYPE map_type = type_of(context, map);
  if (map_type == PJ_TYPE_GEOGRAPHIC_2D_CRS || map_type == PJ_TYPE_GEOGRAPHIC_3D_CRS) {
    throw GeographicSystem(
        fmt::format(
            "crs = \"{}\" ({}) has latitudes and longitudes: points are written as eastings "
            "and northings in metres, as in a UTM zone",
            crs, name),
        proj_get_name(map));
  }
  if (map_type != PJ_TYPE_PROJECTED_CRS) {
    throw InvalidArgument(
        fmt::format("crs = \"{}\" ({}) is not a map projection: points are written as eastings and "
                    "northings in metres, as in a UTM zone",
                    crs, name));
  }
  std::string unit = "no unit";
  for (const PJ* part : {map, static_cast<const PJ*>(vertical.get())}) {
    if (part != nullptr && !in_metres(context, part, unit)) {
      throw InvalidArgument(
          fmt::format("crs = \"{}\" ({}) is in {}: points and their covariances are written in "
                      "metres, so choose "
                      "a map projection in metres",
                      crs, name, unit));
    }
  }
  Object from;
  if (source.empty()) {
    const Object own(proj_crs_get_geodetic_crs(context, map));
    if (own) from.reset(proj_crs_promote_to_3D(context, nullptr, own.get()));
  } else {
    from = create("source", source);
    const PJ_TYPE type = type_of(context, from.get());
    if (type != PJ_TYPE_GEOCENTRIC_CRS && type != PJ_TYPE_GEOGRAPHIC_3D_CRS) {
      throw InvalidArgument(fmt::format(
          "source = \"{}\" ({}) is not three-dimensional: give the datum of the positions "
          "with ellipsoidal heights, such as EPSG:4979 for WGS 84",
          source, proj_get_name(from.get())));
    }
  }
  // Positions are geocentric; a geographic system names their datum.
  const Object geocentric = from ? geocentric_of(context, from.get()) : Object();
  // A map without a height system passes heights above its ellipsoid through.
  Object three(vertical ? proj_clone(context, target.get())
                        : proj_crs_promote_to_3D(context, nullptr, target.get()));
  if (!geocentric || !three) {
    throw InvalidArgument(
        fmt::format("crs = \"{}\" from \"{}\": PROJ says: {}", crs, source, state_->message));
  }
  // Never a transformation that silently omits a grid or a change of datum.
  const char* const options[] = {"ALLOW_BALLPARK=NO", nullptr};
  Object operation(
      proj_create_crs_to_crs_from_pj(context, geocentric.get(), three.get(), nullptr, options));
  if (operation) {
    state_->operation.reset(proj_normalize_for_visualization(context, operation.get()));
  }
  if (!state_->operation) {
    const std::string said = state_->message;
    const std::string missing = missing_grids(context, geocentric.get(), three.get());
    throw InvalidArgument(fmt::format(
        "PROJ cannot transform \"{}\" to \"{}\" ({}) with the files that are installed: {}; "
        "heights "
        "without a height system are ellipsoidal and need none",
        proj_get_name(from.get()), crs, name,
        missing.empty()
            ? "no transformation between them is known" + (said.empty() ? said : ": " + said)
            : missing));
  }
  state_->name = name;
  state_->has_height_system = vertical != nullptr;
  state_->area = area_of(context, map);
  const char* const wkt_options[] = {"MULTILINE=NO", nullptr};
  const char* wkt = proj_as_wkt(context, target.get(), PJ_WKT1_GDAL, wkt_options);
  if (wkt == nullptr) {
    throw InvalidArgument(fmt::format("crs = \"{}\" ({}) cannot be written as WKT 1: PROJ says: {}",
                                      crs, name, state_->message));
  }
  state_->wkt = wkt;
}

MapProjection::~MapProjection() = default;
MapProjection::MapProjection(MapProjection&&) noexcept = default;
MapProjection& MapProjection::operator=(MapProjection&&) noexcept = default;

Vector3d MapProjection::project(const Vector3d& geocentric_m) const {
  const std::lock_guard lock(state_->mutex);
  PJ* operation = state_->operation.get();
  Vector3d mapped = transformed(operation, PJ_FWD, geocentric_m);
  if (!mapped.allFinite()) {
    throw InvalidArgument(
        fmt::format("{} is not defined at the place x = {:.3f}, y = {:.3f}, z = {:.3f} m "
                    "(geocentric): {}",
                    state_->name, geocentric_m.x(), geocentric_m.y(), geocentric_m.z(),
                    proj_errno(operation) == 0
                        ? "no grid covers it"
                        : proj_context_errno_string(state_->context.get(), proj_errno(operation))));
  }
  return mapped;
}

Vector3d MapProjection::unproject(const Vector3d& on_map_m) const {
  const std::lock_guard lock(state_->mutex);
  Vector3d place = transformed(state_->operation.get(), PJ_INV, on_map_m);
  if (!place.allFinite()) {
    throw InvalidArgument(fmt::format("{} has no place with the coordinates {:.3f}, {:.3f}, {:.3f}",
                                      state_->name, on_map_m.x(), on_map_m.y(), on_map_m.z()));
  }
  return place;
}

MapTangent MapProjection::tangent(const Vector3d& geocentric_m) const {
  const Vector3d at = project(geocentric_m);
  std::array<Vector3d, 3> ahead, behind;
  Matrix3d jacobian;
  std::array<Matrix3d, 3> hessian;
  const auto axis = [](Eigen::Index k) { return Vector3d(kStep * Vector3d::Unit(k)); };
  for (Eigen::Index i = 0; i < 3; ++i) {
    ahead[i] = project(geocentric_m + axis(i));
    behind[i] = project(geocentric_m - axis(i));
    jacobian.col(i) = (ahead[i] - behind[i]) / (2 * kStep);
    const Vector3d second = (ahead[i] - 2 * at + behind[i]) / (kStep * kStep);
    for (Eigen::Index m = 0; m < 3; ++m) hessian[m](i, i) = second[m];
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = i + 1; j < 3; ++j) {
      const Vector3d mixed =
          (project(geocentric_m + axis(i) + axis(j)) - ahead[i] - ahead[j] + 2 * at - behind[i] -
           behind[j] + project(geocentric_m - axis(i) - axis(j))) /
          (2 * kStep * kStep);
      for (Eigen::Index m = 0; m < 3; ++m) {
        Matrix3d& h = hessian[m];
        h(i, j) = h(j, i) = mixed[m];
      }
    }
  }
  return {geocentric_m, at, jacobian, hessian};
}

const std::string& MapProjection::name() const { return state_->name; }
const std::string& MapProjection::wkt() const { return state_->wkt; }
const std::optional<AreaOfUse>& MapProjection::area() const { return state_->area; }
bool MapProjection::has_height_system() const { return state_->has_height_system; }

std::string MapProjection::operation() const {
  const std::lock_guard lock(state_->mutex);
  const Object last(proj_trans_get_last_used_operation(state_->operation.get()));
  if (!last) return {};
  PJ_CONTEXT* context = state_->context.get();
  const double accuracy = proj_coordoperation_get_accuracy(context, last.get());
  const std::string name = proj_get_name(last.get());
  if (accuracy == 0) return {};
  return accuracy > 0 ? fmt::format("{}, accuracy {:g} m", name, accuracy)
                      : fmt::format("{}, of unknown accuracy", name);
}

std::string utm_zone_of(double latitude, double longitude, const std::string& system) {
  const double latitude_deg = degrees_from_radians(latitude);
  require_between("latitude", latitude_deg, -80, 84, "degrees, where UTM is used");
  require_finite("longitude", longitude, "rad");
  const double longitude_deg = degrees_from_radians(wrap_to_pi(longitude));
  const int zone = 1 + static_cast<int>(std::floor((longitude_deg + 180) / 6)) % 60;
  std::string code = fmt::format("EPSG:{}", (latitude >= 0 ? 32600 : 32700) + zone);
  if (system == "WGS 84") return code;
  const Context context(proj_context_create());
  const std::string name =
      fmt::format("{} / UTM zone {}{}", system, zone, latitude >= 0 ? 'N' : 'S');
  PJ_OBJ_LIST* found =
      proj_create_from_name(context.get(), "EPSG", name.c_str(), nullptr, 0, 0, 1, nullptr);
  const Object first(found != nullptr && proj_list_get_count(found) > 0
                         ? proj_list_get(context.get(), found, 0)
                         : nullptr);
  proj_list_destroy(found);
  const char* of_system = first ? proj_get_id_code(first.get(), 0) : nullptr;
  return of_system == nullptr ? code : fmt::format("EPSG:{}", of_system);
}

}  // namespace risley::cloud
