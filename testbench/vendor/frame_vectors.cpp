// frame_vectors SCENE WIDTHxHEIGHT OUT.hex: a frame for simulators that know nothing of the project (testbench/vendor/sv/tb_frame.sv): the memory image,
// rays, and the hits that the kernel gives, as 64-bit words in hexadecimal, one a line:
//   0: words of the image I, 1: number of rays N, 2 .. 7: 0; then I words of image, 4 N of rays, 2 N of hits.
// Every second ray is an any-hit ray. Exit code 1 on an error; the file appears whole or not at all.
#include <cinttypes>
#include <cstdio>
#include <string>
#include <vector>

#include "golden/base/output_file.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/kd_builder.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"

namespace {

using namespace retrace;

void write_frame(const std::string& name, int width, int height, const std::string& path) {
  const Scene scene = open_scene(name);
  const WorldTriangles world = flatten(scene);
  const GridScene grid = snap(world);
  const MemoryImage image = build_kd(grid);
  const ViewCamera view = default_view(scene, world);
  std::vector<GridRay> rays;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const GridRay ray =
          quantise(view.ray(x + 0.5, y + 0.5, width, height), grid.transform, grid.box, (x + y) % 2 != 0);
      if (!ray.outside) rays.push_back(ray);
    }
  }
  auto csim = make_csim_engine(image);
  std::vector<Hit> hits(rays.size());
  csim->trace(rays, hits, {}, {});

  std::vector<std::uint64_t> words{image.words().size(), rays.size(), 0, 0, 0, 0, 0, 0};
  words.insert(words.end(), image.words().begin(), image.words().end());
  for (const GridRay& ray : rays) {
    std::uint64_t packed[contract::RayRecord::kWords];
    ray.record.pack(packed);
    words.insert(words.end(), packed, packed + contract::RayRecord::kWords);
  }
  const auto raw = csim->raw_hits();
  words.insert(words.end(), raw.begin(), raw.end());

  std::string text;
  char line[20];
  for (const std::uint64_t word : words) {
    std::snprintf(line, sizeof line, "%016" PRIx64 "\n", word);
    text += line;
  }
  OutputFile output(path);
  output.write(text);
  output.commit();
  std::printf("frame_vectors: %s, %zu triangles, %zu rays, %zu words\n", name.c_str(), world.vertices.size(),
              rays.size(), words.size());
}

}  // namespace

int main(int argc, char** argv) {
  int width = 0, height = 0;
  char end = 0;
  if (argc != 4 || std::sscanf(argv[2], "%dx%d%c", &width, &height, &end) != 2 || width < 1 || height < 1 ||
      width > 512 || height > 512) {
    std::fprintf(stderr, "usage: frame_vectors SCENE WIDTHxHEIGHT OUT.hex (1 to 512 pixels each)\n");
    return 2;
  }
  try {
    write_frame(argv[1], width, height, argv[3]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "frame_vectors: %s\n", error.what());
    return 1;
  }
}
