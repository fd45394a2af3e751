// What a picture made on the chip is given: camera, frame and materials, from a view of a scene.
#pragma once
#include <string>
#include <vector>

#include "golden/engine/engine.hpp"
#include "golden/engine/shade_table.hpp"
#include "golden/render/raster.hpp"
#include "golden/render/surface.hpp"
#include "golden/render/view.hpp"

namespace retrace {

/// Scenes for pictures on the chip are snapped with this reach, so that their boxes fit a camera's record.
inline constexpr double kChipReach = 7.0 / 8.0;

struct ChipOptions {
  int width = 640, height = 480;
  int samples = 1;  ///< a pixel: 1, 2 or 4
  std::uint32_t kind = contract::kPixelColour;
  bool shadows =
      false;  ///< a light over the right shoulder that casts them; otherwise one at the camera's side, which would not show any
};

/// The view as a camera's record. The near plane is left out: what is between it and the eye is seen. Throws Error where no record can say it:
/// an eye more than 2^17 grid units away, a frame that is too wide for its distance.
contract::CameraRecord chip_camera(const ViewCamera& view, const GridScene& grid, int width, int height);

/// A frame in tiles of 16 x 16, lit from afar. Throws Error for sizes out of range.
contract::FrameRecord chip_frame(const ViewCamera& view, const ChipOptions& options);

/// A record for each triangle: its normal on the grid, its base colour in the middle; what emits light shows that colour, unlit. In a scene with
/// instances a record for each triangle of an object, with its normal there, and for each instance how it is turned. So where instances move, the
/// records of 16 bytes of those alone change. An instance that stretches its object has records of its own, with normals of the world.
ShadeTable chip_shading(const Surfaces& surfaces);

/// Pixels of pixel_colour as a picture.
Raster chip_picture(const std::vector<std::uint32_t>& pixels, int width, int height);

}  // namespace retrace
