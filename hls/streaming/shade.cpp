// Kernel shade of the streaming machine: what a hit sends on, a shadow ray and a bounce, and what it sends to its pixel at once.
#include "kernels.hpp"
#include "light.hpp"

extern "C" void stream_shade(hls::stream<retrace::hls::ray_setup_out_word_t>& rays,
                             hls::stream<retrace::hls::hit_word_t>& hits, hls::stream<retrace::hls::note_word_t>& notes,
                             hls::stream<retrace::hls::note_word_t>& direct,
                             hls::stream<retrace::hls::ray_setup_in_word_t>& shadow_rays,
                             hls::stream<retrace::hls::note_word_t>& shadow_notes,
                             hls::stream<retrace::hls::ray_setup_in_word_t>& bounce_rays,
                             hls::stream<retrace::hls::note_word_t>& bounce_notes, const retrace::hls::word_t* grid,
                             const retrace::hls::word_t* materials, ap_uint<32> image_lines, ap_uint<32> material_count,
                             ap_uint<32> light_x, ap_uint<32> light_y, ap_uint<32> light_z, ap_uint<32> light_colour,
                             ap_uint<32> seed, ap_uint<32> count) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=rays
#pragma HLS interface mode=axis port=hits
#pragma HLS interface mode=axis port=notes
#pragma HLS interface mode=axis port=direct
#pragma HLS interface mode=axis port=shadow_rays
#pragma HLS interface mode=axis port=shadow_notes
#pragma HLS interface mode=axis port=bounce_rays
#pragma HLS interface mode=axis port=bounce_notes
#if defined(__BAMBU__)
#pragma HLS interface mode=m_axi port=grid offset=direct bundle=bus_grid
#pragma HLS interface mode=m_axi port=materials offset=direct bundle=bus_materials
#else
  RT_MEMORY(grid, gmem_grid, RETRACE_COSIM_IMAGE_WORDS)
  RT_MEMORY(materials, gmem_materials, RETRACE_COSIM_MATERIAL_WORDS)
  RT_CONTROL(image_lines)
  RT_CONTROL(material_count)
  RT_CONTROL(light_x)
  RT_CONTROL(light_y)
  RT_CONTROL(light_z)
  RT_CONTROL(light_colour)
  RT_CONTROL(seed)
  RT_CONTROL(count)
  RT_CONTROL(return)
#endif
  // clang-format on
  grid_view view = {};
  const int fault = read_grid(grid, image_lines, view);
  light_setting light;
  light.position[0] = light_x;
  light.position[1] = light_y;
  light.position[2] = light_z;
  light.colour[0] = light_colour;
  light.colour[1] = light_colour >> 8;
  light.colour[2] = light_colour >> 16;
  light.seed = seed;
SHADE:
  for (int i = 0; i < kMostRays; ++i) {
    RT_PIPELINE(8)  // dividers of a shadow ray and of a bounce, once a hit
    if (ap_uint<32>(i) >= count) break;
    const ray_setup_out_word_t ray_word = rays.read();
    const ray_setup_out_record ray = read_ray_setup_out(ray_word);
    const hit_word_t hit_word = hits.read();
    const hit_record hit = read_hit(hit_word);
    const note_word_t note_word = notes.read();
    const note in = read_note(note_word);
    const flag_t known = hit.id < material_count && fault == kFaultNone;
    word_t material_words[kMaterialWords];
    material_words[0] = 0;
    if (known && hit.status == retrace::contract::kStatusHit) {
      const word_t two = materials[(hit.id >> 1).to_uint()];
      material_words[0] = two;
      if (hit.id[0] == 1) material_words[0] = two >> 64;
    }
    const material_record material = unpack_material(material_words);
    const lit_point out = light_hit(ray, hit, in, material, known, view, light, ap_uint<32>(i));
    const note_word_t direct_word = write_note(out.direct);
    const ray_setup_in_word_t shadow_word = write_ray_setup_in(out.shadow);
    const note_word_t shadow_note_word = write_note(out.shadow_note);
    const ray_setup_in_word_t bounce_word = write_ray_setup_in(out.bounce);
    const note_word_t bounce_note_word = write_note(out.bounce_note);
    direct.write(direct_word);
    shadow_rays.write(shadow_word);
    shadow_notes.write(shadow_note_word);
    bounce_rays.write(bounce_word);
    bounce_notes.write(bounce_note_word);
  }
}
