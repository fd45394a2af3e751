// frame_vectors: a frame for simulators that know nothing of the project (testbench/vendor/sv/tb_frame.sv): the memory image,
// rays, and the hits that the kernel gives, as 64-bit words in hexadecimal, one a line:
//   0: words of the image I, 1: number of rays N, 2 .. 7: 0; then I words of image, 4 N of rays, 2 N of hits.
// Every second ray is an any-hit ray. Exit code 1 on an error; the file appears whole or not at all.
#include <cinttypes>
#include <cstdio>
#include <string>
#include <vector>

#include "golden/base/output_file.hpp"
#include "golden/render/view.hpp"
#include "golden/tree/traced_scene.hpp"
#include "scenes/open_scene.hpp"
#include "testbench/csim/csim_engine.hpp"
#include "testbench/kit/command_line.hpp"

namespace {

using namespace retrace;

void write_frame(const std::string& name, int width, int height, const std::string& path) {
  const auto [scene, world, grid, image] = prepare_scene(open_scene(name));
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
  std::string scene, output;
  ImageSize size;
  CLI::App app("A frame for simulators that know nothing of the project.", "frame_vectors");
  app.add_option("scene", scene, "A glTF file or a generated scene")->required();
  add_size(app, "size", size, 512, "Rays")->required();
  app.add_option("output", output, "The .hex file")->required();
  return run_program(app, argc, argv, [&] {
    write_frame(scene, size.width, size.height, output);
    return 0;
  });
}
