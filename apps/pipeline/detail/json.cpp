#include "apps/pipeline/detail/json.h"

#include <fmt/format.h>

#include "apps/pipeline/text.h"

namespace lamina {
namespace {

/// Bins as {"from": .., "to": .., "count": ..}; the last one has no "to" when it is open.
Json bin(double from, std::optional<double> to, std::int64_t count) {
  Json b = {{"from", from}};
  b["to"] = to ? Json(*to) : Json();
  b["count"] = count;
  return b;
}

}  // namespace

Json to_json(const Vec3& x) { return {x[0], x[1], x[2]}; }

Json to_json(const Box<3>& box) { return box_numbers(box); }

Json to_json(const Score& s) {
  Json lengths = Json::array(), qualities = Json::array();
  for (std::size_t i = 0; i < Score::kLengthBins.size(); ++i) {
    const bool last = i + 1 == Score::kLengthBins.size();
    lengths.push_back(bin(Score::kLengthBins[i],
                          last ? std::nullopt : std::optional<double>(Score::kLengthBins[i + 1]),
                          s.length_histogram[i]));
  }
  for (std::size_t i = 0; i < s.quality_histogram.size(); ++i)
    qualities.push_back(
        bin(0.1 * static_cast<double>(i), 0.1 * static_cast<double>(i + 1), s.quality_histogram[i]));
  return {{"points", s.points},
          {"cells", s.cells},
          {"edges", s.edges},
          {"complexity", s.complexity},
          {"unit_share", s.unit_share},
          {"length",
           {{"min", s.length_min},
            {"max", s.length_max},
            {"mean", s.length_mean},
            {"share_below_half", s.short_share},
            {"share_above_2", s.long_share},
            {"histogram", lengths}}},
          {"quality", {{"min", s.quality_min}, {"mean", s.quality_mean}, {"histogram", qualities}}},
          {"aspect", {{"max", s.aspect_max}, {"p99", s.aspect_p99}}}};
}

Json to_json(const LayerScore& s) {
  return {{"points", s.points},
          {"on_level", s.on_level},
          {"mean_offset", s.mean_offset},
          {"on_wall", s.on_wall},
          {"ideal_on_wall", s.ideal_on_wall},
          {"edges", s.edges},
          {"aligned_edges", s.aligned},
          {"aligned_of_ideal", s.aligned_of_ideal()}};
}

Json to_json(const WallFit& w) {
  Json worst = Json::array();
  for (const WallFit::Straddler& s : w.worst)
    worst.push_back({{"cell", s.cell}, {"length", s.length}, {"at", to_json(s.at)}});
  const auto distance = [](const WallFit::Worst& d, std::int64_t points) {
    return Json{{"points", points}, {"largest", d.distance}, {"at", to_json(d.at)}};
  };
  return {{"mesh_to_body", distance(w.to_wall, w.mesh_points)},
          {"body_to_mesh", distance(w.to_mesh, w.wall_points)},
          {"anywhere", {{"largest", w.anywhere.distance}, {"at", to_json(w.anywhere.at)}}},
          {"points_outside", w.outside},
          {"straddling_cells", w.straddling},
          {"worst_straddling", worst}};
}

Json to_json(const Validation& v) {
  return {{"valid", v.ok()},
          {"summary", v.summary()},
          {"nonpositive_cells", v.nonpositive_cells},
          {"bad_indices", v.bad_indices},
          {"overshared_facets", v.overshared_facets},
          {"misoriented_facets", v.misoriented_facets},
          {"unused_points", v.unused_points},
          {"boundary_facets", v.boundary_facets},
          {"boundary_mismatch", v.boundary_mismatch},
          {"off_box_facets", v.off_box_facets},
          {"volume", v.volume},
          {"volume_error", v.volume_error},
          {"boundary_area_error", v.boundary_area_error}};
}

Json to_json(const SurfaceReport& s) {
  return {{"triangles_read", s.triangles_read},
          {"points", s.points},
          {"triangles", s.triangles},
          {"shells", s.shells},
          {"watertight", s.watertight()},
          {"nonfinite", s.nonfinite},
          {"merged", s.merged},
          {"negative_zeros", s.negative_zeros},
          {"cut", s.cut},
          {"degenerate", s.degenerate},
          {"duplicate", s.duplicate},
          {"flipped", s.flipped},
          {"shells_turned", s.shells_turned},
          {"shells_mixed", s.shells_mixed},
          {"open_edges", s.open_edges},
          {"nonmanifold_edges", s.nonmanifold_edges},
          {"misoriented_edges", s.misoriented_edges},
          {"area", s.area},
          {"volume", s.volume},
          {"shortest_edge", s.shortest_edge},
          {"longest_edge", s.longest_edge},
          {"facet_sag", s.facet_sag},
          {"repairs", s.repairs},
          {"warnings", s.warnings}};
}

Json to_json(const SurfaceInspection& i) {
  return {{"crossings",
           {{"pairs", i.crossing_pairs},
            {"complete", i.crossings_complete},
            {"first", i.first_crossing ? to_json(*i.first_crossing) : Json()},
            {"meaning", i.crossings_words}}},
          {"sharp_edges", i.sharp_edges},
          {"corners", i.corners},
          {"sag",
           {{"smallest_h_min", i.smallest_h_min},
            {"per_h_min", i.sag_per_h_min ? Json(*i.sag_per_h_min) : Json()},
            {"meaning", i.sag_words}}}};
}

Json to_json(const OutlineReport& o) {
  return {{"points_read", o.points_read}, {"points", o.points},         {"closed_curves", o.closed_curves},
          {"open_curves", o.open_curves}, {"duplicates", o.duplicates}, {"turned", o.turned},
          {"warnings", o.warnings}};
}

Json to_json(const LevelSetReport& r) {
  return {{"voxel", r.voxel},
          {"active_voxels", r.active_voxels},
          {"grid_bytes", r.grid_bytes},
          {"polished_voxels", r.polished_voxels},
          {"worst_polish_vox", r.worst_polish_vox},
          {"sharp_edges", r.sharp_edges},
          {"corners", r.corners},
          {"sign_rule", r.sign_rule},
          {"warnings", r.warnings}};
}

Json to_json(const BoundaryLayer& b) {
  return {
      {"reynolds", b.reynolds},  {"length", b.length},
      {"growth", b.growth},      {"skin_friction", b.skin_friction > 0.0 ? Json(b.skin_friction) : Json()},
      {"h_min", b.h_min},        {"delta", b.delta},
      {"layers", b.layers},      {"top", b.top()},
      {"top_size", b.top_size()}};
}

Json to_json(const Case& c) {
  Json out;
  for (const CaseOption& o : case_options()) {
    const auto value = o.get(c);
    out[o.table][o.key] = value ? std::visit([](const auto& v) { return Json(v); }, *value) : Json();
  }
  return out;
}

Json worst_cells_json(const Score& score) {
  Json out = Json::array();
  for (const WorstCell& w : score.worst)
    out.push_back({{"cell", w.cell}, {"quality", w.quality}, {"center", to_json(w.center)}});
  return out;
}

namespace {

Json homotopy_json(const AdaptSummary& adapt) {
  Json out = Json::array();
  for (const AdaptStep& s : adapt.steps)
    out.push_back({{"size_floor", s.size_floor},
                   {"cells", s.cells},
                   {"points", s.points},
                   {"unit_share", s.unit_share},
                   {"quality_min", s.quality_min},
                   {"quality_mean", s.quality_mean},
                   {"seconds", s.seconds}});
  return out;
}

Json operators_json(const AdaptSummary& adapt) {
  Json out = Json::array();
  for (const OperatorStats& o : adapt.operators)
    out.push_back({{"name", o.name},
                   {"tried", o.tried},
                   {"accepted", o.accepted},
                   {"rejected_quality", o.rejected_quality},
                   {"rejected_length", o.rejected_length},
                   {"rejected_class", o.rejected_class},
                   {"seconds", o.seconds}});
  return out;
}

Json stages_json(const std::vector<StageCost>& stages, int threads) {
  Json out = Json::array();
  for (const StageCost& s : stages)
    out.push_back({{"name", s.name},
                   {"wall_seconds", s.wall_seconds},
                   {"cpu_seconds", s.cpu_seconds},
                   {"user_seconds", s.user_seconds},
                   {"serial_seconds", s.serial_seconds},
                   {"serial_fraction", s.serial_fraction(threads)},
                   {"peak_bytes", s.peak_bytes}});
  return out;
}

}  // namespace

void append_outcome(Json& json, const RunOutcome& outcome) {
  Json files = Json::array();
  for (const auto& file : outcome.files) files.push_back(file.string());
  const StageCost all = total_cost(outcome.stages);
  json["homotopy"] = homotopy_json(outcome.adapt);
  json["operators"] = operators_json(outcome.adapt);
  json["stopped_because"] = outcome.adapt.stopped_because;
  json["stages"] = stages_json(outcome.stages, outcome.threads);
  json["wall_seconds"] = all.wall_seconds;
  json["cpu_seconds"] = all.cpu_seconds;
  json["serial_fraction"] = all.serial_fraction(outcome.threads);
  json["peak_bytes"] = all.peak_bytes;
  json["threads"] = outcome.threads;
  json["files"] = files;
  json["warnings"] = outcome.warnings;
  json["missed"] = outcome.missed;
}

std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, nlohmann::detail::error_handler_t::replace) + "\n";
}

}  // namespace lamina
