// A scene of two levels: trees of objects, each on a grid of its own, and a tree over the instances that place them in the world; and the one image
// that holds them all.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "golden/tree/instance.hpp"
#include "golden/tree/kd_builder.hpp"

namespace retrace {

struct TwoLevelScene {
  std::vector<MemoryImage> objects;
  std::vector<contract::InstanceRecord> instances;
  std::vector<std::uint32_t> object_of;  ///< by instance
  MemoryImage top;  ///< its triangle records are stand-ins: only their ids count, numbers of instances
};

struct PlacedObject {
  std::uint32_t object;
  Placement to_world;
};

/// Builds the trees of the objects and of the world. `root` of a record is the number of its object here: a memory image of several trees puts
/// root pairs there. Throws Error where an object's root box leaves [-kObjectReach, kObjectReach] or a placement has no record.
TwoLevelScene build_two_levels(std::span<const GridScene> objects, std::span<const PlacedObject> placed);

/// The root box of the top level over these instances of these objects, position codes by face.
std::array<std::int32_t, 6> top_level_box(std::span<const GridScene> objects, std::span<const GridInstance> instances);

/// All trees, triangles and instances as one image of version image_version_two_levels: pair 0 is the top tree's root, roots in instance records are
/// pairs of the image, references of its leaves of instances are numbers of instance records. Objects stand in front of what else the top level
/// has, in each table.
MemoryImage make_two_level_image(const TwoLevelScene& scene);

/// The words of that image, for those who change them.
std::vector<std::uint64_t> assemble_two_levels(const TwoLevelScene& scene);

/// What following a frame cost.
struct TwoLevelFrame {
  double objects_s = 0.0;      ///< trees of objects whose triangles changed
  double top_s = 0.0;          ///< tree of the top level
  double write_s = 0.0;        ///< into the image
  std::size_t bytes = 0;       ///< written, in whole lines of 64 bytes
  std::size_t objects = 0;     ///< rebuilt
  bool laid_out_anew = false;  ///< the whole image was written: objects changed, or the top level has outgrown its room
};

/// The image of a GridScene of two levels that follows its instances: where they alone move, header, top level and instance records are written
/// over those of the frame before, and nothing else is.
class TwoLevelImage {
 public:
  /// `moves`: leaves room for another top level. Throws Error.
  TwoLevelImage(const GridScene& scene, bool moves, const BuildOptions& options = {});
  /// The scene as it stands now. `changed`: numbers of objects with other triangles than before; all of them if there are more or fewer.
  TwoLevelFrame update(const GridScene& scene, std::span<const std::uint32_t> changed = {});
  const MemoryImage& image() const { return image_; }
  MemoryImage release() && { return std::move(image_); }
  /// What building it cost.
  const TwoLevelFrame& first() const { return first_; }

 private:
  void lay_out();
  std::size_t write_over();

  BuildOptions options_;
  bool moves_;
  TwoLevelScene scene_;
  MemoryImage image_;
  TwoLevelFrame first_;
  struct Counts {
    std::size_t pairs = 1, leaves = 0, list = 0;
  };
  Counts objects_in_;                 ///< where the top level begins in each table
  std::vector<std::uint32_t> roots_;  ///< pairs, by object
  std::uint32_t fixed_crc_[4] = {};   ///< of what no frame changes, between what frames write
};

}  // namespace retrace
