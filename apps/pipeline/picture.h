// Pictures of a mesh: the cells an axis-aligned plane cuts (or a plane mesh itself), coloured, with the wall
// and the top of the boundary layer drawn in.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/pipeline/case.h"
#include "mesh/mesh.h"

namespace lamina {

enum class PictureColor {
  kPlain,    ///< one light grey
  kQuality,  ///< cell field "quality", red at 0, yellow, blue-white at 1
  kRegion,   ///< cell tags, those of `lamina mesh` as Region, four light colours in turn
  kLevels,   ///< point field "level_offset", blue-white on the levels, red half a layer off, grey elsewhere
  kSize,     ///< point field "hn", logarithmic from the smallest to the largest in the window
};

struct PictureOptions {
  Plane plane;  ///< of a 3D mesh
  std::optional<std::array<double, 4>>
      window;  ///< u0 v0 u1 v1 in the plane, world units; (u, v) = (y, z), (x, z) or
               ///< (x, y) for planes across x, y, z. DEFAULT: the whole slice
  PictureColor color = PictureColor::kQuality;  ///< kPlain where the mesh lacks the data
  double layer_top = 0.0;                       ///< phi of the blue line; <= 0: none
  std::vector<double> levels;  ///< phi of green lines, ascending; of those closer than a few pixels none
  double inner = 0.0;          ///< phi of the orange line, the last layer within the body; >= 0: none
  int width_px = 1400;         ///< in [200, 8000]; the height follows, with equal aspect
  std::string title;           ///< empty: none
};

/// Top, levels and inner layer of a case.
void set_levels(PictureOptions& options, const BoundaryLayer& layer, int mirrored_layers);

/// Throws kFileUnsupported unless the extension is .png, .svg or .pdf.
void check_picture_extension(const std::filesystem::path& path);

/// Draws to .png, .svg or .pdf (the extension decides), atomically; the same bytes for the same input. The
/// wall, phi = 0 of the point field "phi", is red where that field is there, phi = layer_top blue. Outlines
/// fade where cells get thinner than a few pixels, so that dense layers do not turn black. Errors:
/// kFileUnsupported (extension), kParameter (options; nothing of the mesh in plane and window), kFileWrite.
/// Cost: one pass over the cells and what cairo takes for the polygons of the slice.
void draw_slice(const std::filesystem::path& path, const Mesh<3>& mesh, const PictureOptions& options);
void draw_slice(const std::filesystem::path& path, const Mesh<2>& mesh, const PictureOptions& options);

}  // namespace lamina
