// A living room: window with a painted view, table laid for tea, chairs, armchair, bookshelf, rug, lamps, plant,
// sculpture. The shell is closed, the well behind the window included, so that no ray leaves it.
#include "scenes/room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <string>
#include <utility>

#include "scenes/shapes.hpp"

namespace retrace {
namespace {

using namespace shapes;

constexpr double kPi = glm::pi<double>();

// Inside of the room: x from -3 to 3, y from 0 to 2.7, z from -2.4 to 2.4; the window is in the wall at x = -3.
constexpr double kX = 3.0, kY = 2.7, kZ = 2.4;
constexpr double kSill = 0.85, kHead = 2.3, kJambA = -1.25, kJambB = 0.75;  // window opening: y and z
constexpr double kView = -5.6;                                              // x of the painted view

/// A colour as a screen shows it (sRGB), linear.
glm::vec3 srgb(double r, double g, double b) {
  const auto linear = [](double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); };
  return {linear(r), linear(g), linear(b)};
}

double smooth(double lower, double upper, double x) {
  const double t = std::clamp((x - lower) / (upper - lower), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Makes detail 1 about 230,000 triangles.
constexpr double kDefaultFineness = 0.865;

class Room {
 public:
  Room(double detail, std::uint64_t seed)
      : fineness_(kDefaultFineness * std::sqrt(detail)), random_(seed), noise_seed_(static_cast<std::uint32_t>(seed)) {}

  Scene make() {
    shell();
    window();
    curtains();
    rug();
    table();
    tea();
    chairs();
    armchair();
    bookshelf();
    sideboard();
    lamps();
    plant();
    pictures();
    camera();
    return std::move(scene_);
  }

 private:
  using Part = std::pair<Primitive, std::uint32_t>;

  /// A number of cells, scaled with the detail.
  int cells(double base, int least = 3) const {
    return std::max(least, static_cast<int>(std::lround(base * fineness_)));
  }

  std::uint32_t material(const std::string& name, const glm::vec3& color, float roughness, float metallic = 0.0f) {
    for (std::uint32_t i = 0; i < scene_.materials.size(); ++i)
      if (scene_.materials[i].name == name) return i;
    Material m;
    m.name = name;
    m.base_color = glm::vec4(color, 1.0f);
    m.roughness = roughness;
    m.metallic = metallic;
    scene_.materials.push_back(m);
    return static_cast<std::uint32_t>(scene_.materials.size() - 1);
  }

  /// A texture of sRGB colours in [0, 1] over [0, 1]^2, v downwards, as the file will hold it: rounded to 8 bits.
  std::uint32_t texture(const std::string& name, int width, int height,
                        const std::function<glm::dvec3(double, double)>& color) {
    // Below detail 1 the textures shrink, too.
    const double shrink = std::min(1.0, fineness_ / kDefaultFineness);
    width = std::max(16, static_cast<int>(std::lround(width * shrink)));
    height = std::max(16, static_cast<int>(std::lround(height * shrink)));
    Texture t;
    t.name = name;
    t.width = width;
    t.height = height;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const glm::dvec3 c =
            glm::floor(glm::clamp(color((x + 0.5) / width, (y + 0.5) / height), 0.0, 1.0) * 255.0 + 0.5) / 255.0;
        t.texels.emplace_back(srgb(c.x, c.y, c.z), 1.0f);
      }
    scene_.textures.push_back(std::move(t));
    return static_cast<std::uint32_t>(scene_.textures.size() - 1);
  }

  std::uint32_t textured(const std::string& name, std::uint32_t texture, float roughness) {
    const std::uint32_t m = material(name, glm::vec3(1.0f), roughness);
    scene_.materials[m].base_texture = texture;
    return m;
  }

  std::uint32_t mesh(const std::string& name, std::vector<Part> parts) {
    Mesh m;
    m.name = name;
    for (Part& part : parts) {
      part.first.material = part.second;
      if (scene_.materials[part.second].base_texture == kNone) part.first.texcoords[0].clear();
      m.primitives.push_back(std::move(part.first));
    }
    scene_.meshes.push_back(std::move(m));
    return static_cast<std::uint32_t>(scene_.meshes.size() - 1);
  }

  Node& node(const std::string& name, const glm::dvec3& place = glm::dvec3(0.0), double turn = 0) {
    scene_.roots.push_back(static_cast<std::uint32_t>(scene_.nodes.size()));
    scene_.nodes.emplace_back();
    Node& n = scene_.nodes.back();
    n.name = name;
    n.translation = place;
    if (turn != 0) n.rotation = glm::angleAxis(turn, glm::dvec3(0, 1, 0));
    return n;
  }

  void object(const std::string& name, std::vector<Part> parts, const glm::dvec3& place = glm::dvec3(0.0),
              double turn = 0) {
    const std::uint32_t index = mesh(name, std::move(parts));
    node(name, place, turn).mesh = index;
  }

  void aim(Node& n, const glm::dvec3& from, const glm::dvec3& to) {
    n.translation = from;
    n.rotation = glm::quat_cast(glm::dmat3(glm::inverse(glm::lookAt(from, to, glm::dvec3(0, 1, 0)))));
  }

  // ------------------------------------------------------------------------------------------------------ the building

  void shell() {
    const std::uint32_t planks = texture("planks", 512, 512, [&](double u, double v) {
      const double row = std::floor(v * 8);
      const double shift = 0.5 * noise({row * 7.31, 0.5, 0.5}, noise_seed_) + 0.37 * row;
      const double along = u * 2 + shift;
      const double board = std::floor(along);
      const double tone = 0.5 + 0.5 * noise({row * 3.7 + 0.3, std::fmod(board, 2.0) * 5.3 + 0.7, 0.2}, noise_seed_ + 5);
      // The grain has the texture's period in u: it runs around a circle.
      const double a = 2 * kPi * u;
      const double grain = fractal_noise({2.0 * std::cos(a), 2.0 * std::sin(a) + 9 * row, v * 90}, 3, noise_seed_ + 9);
      const double f = v * 8 - row, g = along - board;
      const double gap =
          std::min(smooth(0, 0.03, f) * smooth(0, 0.03, 1 - f), smooth(0, 0.006, g) * smooth(0, 0.006, 1 - g));
      const glm::dvec3 wood = glm::mix(glm::dvec3(0.50, 0.33, 0.20), glm::dvec3(0.66, 0.46, 0.29),
                                       std::clamp(tone + 0.30 * grain, 0.0, 1.0));
      return wood * (0.45 + 0.55 * gap);
    });
    object("floor",
           {{quad({-kX, 0, kZ}, {2 * kX, 0, 0}, {0, 0, -2 * kZ}, 1, 1, {4, 3.2}), textured("planks", planks, 0.38f)}});

    const std::uint32_t plaster = material("plaster", srgb(0.90, 0.87, 0.81), 0.95f);
    const std::uint32_t sage = material("sage wall", srgb(0.52, 0.60, 0.54), 0.9f);
    const std::uint32_t white = material("white paint", srgb(0.94, 0.93, 0.90), 0.5f);
    object("ceiling", {{quad({-kX, kY, -kZ}, {2 * kX, 0, 0}, {0, 0, 2 * kZ}),
                        material("ceiling", srgb(0.95, 0.94, 0.92), 0.95f)}});
    object("back wall", {{quad({-kX, 0, -kZ}, {2 * kX, 0, 0}, {0, kY, 0}), sage}});
    Primitive walls;
    append(walls, quad({kX, 0, -kZ}, {0, 0, 2 * kZ}, {0, kY, 0}));
    append(walls, quad({kX, 0, kZ}, {-2 * kX, 0, 0}, {0, kY, 0}));
    // The window wall: below, above and beside the opening, and the reveal around it.
    const auto piece = [&](double z0, double z1, double y0, double y1) {
      append(walls, quad({-kX, y0, z1}, {0, 0, z0 - z1}, {0, y1 - y0, 0}));
    };
    piece(-kZ, kZ, 0, kSill);
    piece(-kZ, kZ, kHead, kY);
    piece(-kZ, kJambA, kSill, kHead);
    piece(kJambB, kZ, kSill, kHead);
    constexpr double kReveal = 0.22;
    const glm::dvec3 in(-kReveal, 0, 0), across(0, 0, kJambB - kJambA), up(0, kHead - kSill, 0);
    append(walls, quad({-kX, kSill, kJambA}, across, in));
    append(walls, quad({-kX, kHead, kJambB}, -across, in));
    append(walls, quad({-kX, kSill, kJambA}, in, up));
    append(walls, quad({-kX, kSill, kJambB}, up, in));
    object("walls", {{std::move(walls), plaster}});

    // Skirting and cornice: boxes along the walls.
    Primitive trim;
    for (const auto& [y0, y1, depth] :
         {std::array{0.0, 0.14, 0.02}, std::array{kY - 0.10, kY, 0.06}, std::array{kY - 0.14, kY - 0.10, 0.025}}) {
      append(trim, box({-kX, y0, -kZ}, {kX, y1, -kZ + depth}));
      append(trim, box({-kX, y0, -kZ + depth}, {-kX + depth, y1, kZ}));
      append(trim, box({kX - depth, y0, -kZ + depth}, {kX, y1, kZ}));
    }
    object("trim", {{std::move(trim), white}});

    // Behind the window: a well, painted with a view, lit by a lamp of its own.
    const std::uint32_t view = texture("view", 512, 384, [&](double u, double v) {
      const double hill1 = 0.62 + 0.07 * fractal_noise({u * 4, 0.3, 0.1}, 4, noise_seed_ + 20);
      const double hill2 = 0.72 + 0.06 * fractal_noise({u * 5, 4.3, 0.1}, 4, noise_seed_ + 21);
      const double trees = 0.80 + 0.03 * fractal_noise({u * 34, 7.3, 0.1}, 3, noise_seed_ + 22);
      glm::dvec3 c = glm::mix(glm::dvec3(0.42, 0.62, 0.88), glm::dvec3(0.93, 0.93, 0.88), smooth(0.0, 0.66, v));
      const double cloud = fractal_noise({u * 6, v * 14, 3.0}, 5, noise_seed_ + 23);
      c = glm::mix(c, glm::dvec3(1.0, 0.98, 0.95), 0.8 * smooth(0.02, 0.35, cloud) * (1 - smooth(0.3, 0.6, v)));
      const double leaf = 0.5 + 0.5 * fractal_noise({u * 90, v * 70, 1.0}, 3, noise_seed_ + 24);
      if (v > hill1) c = glm::dvec3(0.55, 0.66, 0.70);
      if (v > hill2) c = glm::mix(glm::dvec3(0.40, 0.53, 0.42), glm::dvec3(0.48, 0.60, 0.44), leaf);
      if (v > trees) c = glm::mix(glm::dvec3(0.20, 0.33, 0.16), glm::dvec3(0.38, 0.50, 0.22), leaf);
      return c;
    });
    constexpr double kWellA = kJambA - 1.6, kWellB = kJambB + 1.6, kWellLow = -0.6, kWellHigh = 4.6;
    const std::uint32_t painted = textured("view", view, 1.0f);
    Primitive backdrop = quad({kView, kWellLow, kWellB}, {0, 0, kWellA - kWellB}, {0, kWellHigh - kWellLow, 0});
    for (glm::vec2& t : backdrop.texcoords[0]) t.y = 1 - t.y;  // images begin at the top
    object("view", {{std::move(backdrop), painted}});
    Primitive well;
    const double wall = -kX - kReveal;
    const glm::dvec3 out(wall - kView, 0, 0), width(0, 0, kWellB - kWellA), height(0, kWellHigh - kWellLow, 0);
    append(well, quad({kView, kWellLow, kWellA}, out, height));
    append(well, quad({wall, kWellLow, kWellB}, -out, height));
    append(well, quad({kView, kWellLow, kWellB}, out, -width));
    append(well, quad({kView, kWellHigh, kWellA}, out, width));
    // Outer face of the window wall, with the same opening.
    const auto outer = [&](double z0, double z1, double y0, double y1) {
      append(well, quad({wall, y0, z0}, {0, 0, z1 - z0}, {0, y1 - y0, 0}));
    };
    outer(kWellA, kWellB, kWellLow, kSill);
    outer(kWellA, kWellB, kHead, kWellHigh);
    outer(kWellA, kJambA, kSill, kHead);
    outer(kJambB, kWellB, kSill, kHead);
    object("well", {{std::move(well), material("haze", srgb(0.80, 0.86, 0.92), 1.0f)}});
  }

  void window() {
    const std::uint32_t white = material("white paint", srgb(0.94, 0.93, 0.90), 0.5f);
    Primitive frame;
    const int fine = cells(3, 1);
    const double x0 = -kX - 0.14, x1 = -kX - 0.08, mid = 0.5 * (kJambA + kJambB);
    const auto bar = [&](double y0, double y1, double z0, double z1, double bulge = 0) {
      append(frame, rounded_box({x0 - bulge, y0, z0}, {x1 + bulge, y1, z1}, 0.008, fine));
    };
    bar(kSill, kSill + 0.06, kJambA, kJambB, 0.01);
    bar(kHead - 0.06, kHead, kJambA, kJambB, 0.01);
    bar(kSill, kHead, kJambA, kJambA + 0.06, 0.01);
    bar(kSill, kHead, kJambB - 0.06, kJambB, 0.01);
    bar(kSill, kHead, mid - 0.035, mid + 0.035, 0.01);
    for (const double z : {0.5 * (kJambA + mid), 0.5 * (kJambB + mid)}) bar(kSill, kHead, z - 0.014, z + 0.014);
    for (int i = 1; i < 3; ++i) {
      const double y = kSill + (kHead - kSill) * i / 3.0;
      bar(y - 0.014, y + 0.014, kJambA, kJambB);
    }
    append(frame, rounded_box({-kX - 0.10, kSill - 0.035, kJambA - 0.08}, {-kX + 0.10, kSill + 0.008, kJambB + 0.08},
                              0.012, fine));
    object("window frame", {{std::move(frame), white}});
  }

  void curtains() {
    const std::uint32_t linen = material("linen", srgb(0.80, 0.69, 0.53), 0.95f);
    scene_.materials[linen].double_sided = true;
    const double top = 2.47, bottom = 0.05;
    for (int side = 0; side < 2; ++side) {
      const double z0 = side ? kJambB - 0.12 : kJambA + 0.12, z1 = side ? kJambB + 0.52 : kJambA - 0.52;
      object(side ? "right curtain" : "left curtain",
             {{surface(cells(150, 24), cells(26, 4),
                       [&](double u, double v) {
                         const double fold = 2 * kPi * 6.5 * (u + 0.02 * std::sin(2 * kPi * (1.5 * v + side)));
                         const double depth = 0.022 + 0.028 * (1 - v);
                         const double x = -kX + 0.21 + depth * std::sin(fold) +
                                          0.015 * noise({u * 3, v * 2, 1.0 + side}, noise_seed_);
                         return glm::dvec3(x, bottom + (top - bottom) * v, z0 + (z1 - z0) * u * (1 + 0.06 * (1 - v)));
                       }),
               linen}});
    }
    const std::uint32_t brass = material("brass", srgb(0.80, 0.65, 0.38), 0.3f, 1.0f);
    Primitive rod =
        tube([&](double t) { return glm::dvec3(-kX + 0.21, top + 0.02, kJambA - 0.7 + t * (kJambB - kJambA + 1.4)); },
             [](double) { return 0.014; }, cells(20, 6), 1, true);
    for (const double z : {kJambA - 0.7, kJambB + 0.7})
      append(rod, sphere(0.032, cells(28, 8)), translate(-kX + 0.21, top + 0.02, z));
    object("curtain rod", {{std::move(rod), brass}});
  }

  // ------------------------------------------------------------------------------------------------------ the
  // furniture

  void rug() {
    const std::uint32_t pattern = texture("rug", 384, 288, [&](double u, double v) {
      const double x = std::abs(u - 0.5) * 2, y = std::abs(v - 0.5) * 2;  // 0 in the middle, 1 at the border
      const double border = std::max(1 - (1 - x) * 4.0 / 3, y);
      const glm::dvec3 red(0.52, 0.14, 0.13), blue(0.13, 0.19, 0.33), sand(0.82, 0.70, 0.50), teal(0.20, 0.40, 0.40);
      glm::dvec3 c = red;
      const double diamond = std::fmod(std::abs(x * 4) + std::abs(y * 3), 1.0);
      if (diamond < 0.16)
        c = sand;
      else if (diamond < 0.30)
        c = blue;
      const double medallion = std::hypot(x * 1.333, y);
      if (medallion < 0.62)
        c = std::fmod(medallion * 9 + 0.35 * std::cos(8 * std::atan2(y, x * 1.333)), 1.0) < 0.4 ? sand : teal;
      if (medallion < 0.16) c = red;
      if (border > 0.72) c = blue;
      if (border > 0.76 && border < 0.92) c = std::sin(u * 140) * std::sin(v * 105) > 0 ? sand : red;
      if (border > 0.96) c = sand;
      return c * (0.88 + 0.12 * fractal_noise({u * 120, v * 90, 2.0}, 2, noise_seed_ + 30));
    });
    const double w = 2.7, h = 2.0;
    Primitive pile = surface(cells(160, 8), cells(118, 6), [&](double u, double v) {
      const double x = (u - 0.5) * w, z = (0.5 - v) * h;
      const double edge = smooth(0, 0.02, std::min(std::min(u, 1 - u) * w, std::min(v, 1 - v) * h));
      const double wave = 0.006 * fractal_noise({x * 1.7, z * 1.7, 0.5}, 2, noise_seed_ + 31);
      const double tuft = 0.0035 * noise({x * 60, z * 60, 0.5}, noise_seed_ + 32);
      return glm::dvec3(x, 0.004 + edge * (0.014 + wave + tuft), z);
    });
    const std::uint32_t wool = textured("rug", pattern, 1.0f);
    Primitive fringe;
    const int tassels = 90;
    for (int side = -1; side <= 1; side += 2)
      for (int i = 0; i < tassels; ++i) {
        const double z = ((i + 0.5) / tassels - 0.5) * (h - 0.03), bend = 0.012 * random_.uniform(-1, 1);
        append(fringe, tube(
                           [&](double t) {
                             return glm::dvec3(side * (w / 2 - 0.005 + 0.07 * t), 0.008 - 0.003 * t, z + bend * t * t);
                           },
                           [](double t) { return 0.0035 * (1 - 0.4 * t); }, cells(5), cells(3, 1), true));
      }
    object("rug", {{std::move(pile), wool}, {std::move(fringe), material("wool", srgb(0.86, 0.80, 0.68), 1.0f)}},
           {kTableX, 0, kTableZ}, 0.12);
  }

  void table() {
    const std::uint32_t oak = material("oak", srgb(0.50, 0.33, 0.19), 0.42f);
    const glm::dvec2 top[] = {{0, 0.715},     {0, 0.715},    {0.60, 0.715}, {0.60, 0.715}, {0.64, 0.722},
                              {0.655, 0.735}, {0.64, 0.748}, {0.60, 0.75},  {0.60, 0.75},  {0, 0.75}};
    const glm::dvec2 leg[] = {{0.10, 0.08}, {0.11, 0.10},  {0.09, 0.16}, {0.05, 0.20}, {0.045, 0.26}, {0.075, 0.36},
                              {0.08, 0.42}, {0.055, 0.50}, {0.04, 0.56}, {0.05, 0.62}, {0.09, 0.68},  {0.16, 0.715}};
    Primitive p = lathe(top, cells(96, 12), cells(3, 1));
    append(p, lathe(leg, cells(56, 8), cells(4, 1)));
    for (int i = 0; i < 3; ++i)
      append(
          p,
          tube([](double t) { return glm::dvec3(0.06 + 0.42 * t, 0.15 - 0.12 * t * t - 0.02 * std::sin(kPi * t), 0); },
               [](double t) { return 0.042 - 0.018 * t; }, cells(24, 6), cells(18, 3), true),
          rotate_y(2 * kPi * i / 3 + 0.3));
    object("table", {{std::move(p), oak}}, {kTableX, 0, kTableZ});
  }

  void tea() {
    const std::uint32_t glaze = material("celadon glaze", srgb(0.40, 0.60, 0.55), 0.15f);
    const std::uint32_t china = material("china", srgb(0.95, 0.94, 0.90), 0.2f);
    const std::uint32_t brass = material("brass", srgb(0.80, 0.65, 0.38), 0.3f, 1.0f);
    const double y = kTableTop;

    const glm::dvec2 body[] = {{0, 0},         {0, 0},         {0.060, 0},     {0.066, 0.006}, {0.064, 0.012},
                               {0.095, 0.040}, {0.110, 0.075}, {0.100, 0.110}, {0.072, 0.132}, {0.060, 0.136},
                               {0.060, 0.136}, {0.058, 0.142}, {0.050, 0.150}, {0.025, 0.160}, {0.010, 0.164},
                               {0.008, 0.170}, {0.016, 0.180}, {0.014, 0.190}, {0, 0.194}};
    Primitive pot = lathe(body, cells(72, 10), cells(4, 1));
    append(pot, tube(
                    [](double t) {
                      return glm::dvec3(0.085 + 0.10 * t - 0.02 * std::sin(kPi * t),
                                        0.055 + 0.085 * t * t + 0.01 * std::sin(2 * kPi * t), 0);
                    },
                    [](double t) { return 0.024 - 0.013 * t; }, cells(28, 6), cells(24, 4), true));
    append(pot, tube(
                    [](double t) {
                      const double a = kPi * (0.08 + 0.84 * t);
                      return glm::dvec3(-0.088 - 0.075 * std::sin(a), 0.075 + 0.055 * std::cos(a), 0);
                    },
                    [](double) { return 0.0085; }, cells(18, 5), cells(30, 5), true));
    object("teapot", {{std::move(pot), glaze}}, {kTableX + 0.06, y, kTableZ + 0.10}, 2.5);

    // Cup and saucer, one mesh for all places.
    const glm::dvec2 cup[] = {{0, 0.012},     {0, 0.012},     {0.020, 0.012}, {0.021, 0.018},
                              {0.036, 0.036}, {0.042, 0.062}, {0.043, 0.070}, {0.041, 0.0705},
                              {0.039, 0.062}, {0.033, 0.038}, {0.018, 0.022}, {0, 0.020}};
    const glm::dvec2 saucer[] = {{0, 0},         {0, 0},          {0.035, 0},     {0.050, 0.006}, {0.072, 0.013},
                                 {0.074, 0.016}, {0.071, 0.0165}, {0.048, 0.010}, {0.030, 0.012}, {0, 0.012}};
    Primitive set = lathe(cup, cells(48, 8), cells(3, 1));
    append(set, lathe(saucer, cells(48, 8), cells(2, 1)));
    append(set, tube(
                    [](double t) {
                      const double a = kPi * (0.06 + 0.88 * t);
                      return glm::dvec3(0.036 + 0.026 * std::sin(a), 0.047 + 0.018 * std::cos(a), 0);
                    },
                    [](double) { return 0.0038; }, cells(12, 5), cells(18, 4), true));
    const glm::dvec2 drink[] = {{0.0375, 0.058}, {0, 0.058}};
    Primitive surface_of_tea = lathe(drink, cells(40, 8));
    const std::uint32_t service = mesh(
        "cup", {{std::move(set), china}, {std::move(surface_of_tea), material("tea", srgb(0.45, 0.20, 0.06), 0.05f)}});
    for (int i = 0; i < 3; ++i) {
      const double a = kChairAngles[i];
      node("cup " + std::to_string(i + 1),
           {kTableX + 0.42 * std::cos(a) + 0.08 * std::sin(a), y, kTableZ - 0.42 * std::sin(a) + 0.08 * std::cos(a)},
           a + 0.9)
          .mesh = service;
    }

    // A bowl of fruit.
    const glm::dvec2 bowl[] = {{0, 0},         {0, 0},         {0.055, 0},     {0.058, 0.012},
                               {0.050, 0.018}, {0.100, 0.045}, {0.145, 0.085}, {0.150, 0.094},
                               {0.145, 0.095}, {0.135, 0.085}, {0.090, 0.050}, {0, 0.030}};
    const glm::dvec3 at(kTableX - 0.24, y, kTableZ - 0.16);
    object("bowl", {{lathe(bowl, cells(64, 10), cells(3, 1)), brass}}, at);
    const int fine = cells(13, 4);
    const std::uint32_t apple = mesh(
        "apple", {{cube_sphere(fine,
                               [](const glm::dvec3& d) {
                                 return 0.040 * (1 - 0.28 * std::exp(-9 * (1 - d.y)) - 0.12 * std::exp(-9 * (1 + d.y)));
                               }),
                   material("apple", srgb(0.72, 0.13, 0.10), 0.3f)}});
    const std::uint32_t orange = mesh(
        "orange", {{cube_sphere(fine, [&](const glm::dvec3& d) { return 0.040 * (1 + 0.012 * noise(d * 22.0, 3)); }),
                    material("orange", srgb(0.93, 0.50, 0.08), 0.45f)}});
    const glm::dvec3 places[] = {
        {0.055, 0.086, 0.01}, {-0.03, 0.086, 0.05}, {-0.035, 0.086, -0.045}, {0.03, 0.090, -0.055}, {0.0, 0.138, 0.0}};
    for (int i = 0; i < 5; ++i) {
      Node& n = node("fruit " + std::to_string(i + 1), at + places[i]);
      n.mesh = i % 2 ? orange : apple;
      n.rotation = glm::angleAxis(random_.uniform(-0.5, 0.5), random_.direction());
    }
  }

  void chairs() {
    const std::uint32_t beech = material("beech", srgb(0.66, 0.47, 0.29), 0.45f);
    Primitive p;
    // Seat: a saddle, thicker at the rim.
    const int n = cells(26, 4);
    const auto seat = [&](double u, double v, bool top) {
      const double a = 2 * (u - 0.5), b = 2 * (v - 0.5);
      const double r = std::max(std::abs(a), std::abs(b)),
                   round = r > 0 ? r / std::pow(std::pow(std::abs(a), 4) + std::pow(std::abs(b), 4), 0.25) : 1;
      const double x = 0.21 * a * round, z = 0.20 * b * round;
      const double dip = 0.016 * (1 - smooth(0.2, 0.9, r));
      return glm::dvec3(x, top ? 0.455 - dip - 0.012 * smooth(0.9, 1.0, r) : 0.425 + 0.006 * smooth(0.9, 1.0, r), z);
    };
    append(p, surface(n, n, [&](double u, double v) { return seat(u, 1 - v, true); }));
    append(p, surface(n, n, [&](double u, double v) { return seat(u, v, false); }));
    append(p, surface(4 * n, cells(4, 1), [&](double u, double v) {
             // Around the rim, from the lower face to the upper one.
             const double s = 4 * u;
             const double side = std::floor(std::min(s, 3.999999)), t = s - side;
             const double a = side == 0   ? t
                              : side == 1 ? 1
                              : side == 2 ? 1 - t
                                          : 0,
                          b = side == 0   ? 1
                              : side == 1 ? 1 - t
                              : side == 2 ? 0
                                          : t;
             const glm::dvec3 low = seat(a, b, false), high = seat(a, b, true);
             const glm::dvec3 out = glm::dvec3(low.x, 0, low.z) * (0.03 * std::sin(kPi * v));
             return glm::mix(low, high, v) + out;
           }));
    const int around = cells(14, 5), along = cells(13, 3);
    const auto stick = [&](const glm::dvec3& from, const glm::dvec3& to, double thick, double thin) {
      append(p, tube([&](double t) { return glm::mix(from, to, t); },
                     [&](double t) { return thin + (thick - thin) * std::pow(std::sin(kPi * (0.15 + 0.7 * t)), 2); },
                     around, along, true));
    };
    for (int i = 0; i < 4; ++i) {
      const double sx = i & 1 ? 1 : -1, sz = i & 2 ? 1 : -1;
      stick({sx * 0.20, 0, sz * 0.20}, {sx * 0.15, 0.43, sz * 0.14}, 0.021, 0.011);
    }
    stick({-0.178, 0.19, -0.172}, {-0.178, 0.19, 0.172}, 0.013, 0.008);
    stick({0.178, 0.19, -0.172}, {0.178, 0.19, 0.172}, 0.013, 0.008);
    stick({-0.175, 0.19, 0}, {0.175, 0.19, 0}, 0.013, 0.008);
    // Back (at -x): a bow with spindles.
    const auto bow = [](double t) {
      const double a = kPi * t;
      return glm::dvec3(-0.17 - 0.10 * std::sin(a), 0.45 + 0.46 * std::pow(std::sin(a), 0.7), -0.185 * std::cos(a));
    };
    append(p, tube(
                  bow, [](double) { return 0.012; }, around, 3 * along, true));
    for (int i = 1; i < 8; ++i) {
      const double t = 0.5 + (i - 4) * 0.082;
      const glm::dvec3 top = bow(t);
      stick({-0.165, 0.44, 0.72 * top.z}, top, 0.0085, 0.005);
    }
    const std::uint32_t chair = mesh("chair", {{std::move(p), beech}});
    for (int i = 0; i < 3; ++i) {
      const double a = kChairAngles[i], r = kChairReach[i];
      node("chair " + std::to_string(i + 1), {kTableX + r * std::cos(a), 0.018, kTableZ - r * std::sin(a)},
           a + kPi + kChairTurn[i])
          .mesh = chair;
    }
  }

  /// A cushion: a box whose faces bulge.
  Primitive cushion(const glm::dvec3& size, double bulge) {
    Primitive p = cube_sphere(cells(17, 4), [](const glm::dvec3&) { return 1.0; });
    for (glm::vec3& q : p.positions) {
      const glm::dvec3 d(q);
      const auto power = [](double x) { return std::pow(std::abs(x), 5.0); };
      const double box = std::pow(power(d.x) + power(d.y) + power(d.z), 1 / 5.0);  // onto a rounded cube
      glm::dvec3 s = d / box;
      s.y *= 1 + bulge * (1 - s.x * s.x) * (1 - s.z * s.z);
      q = glm::vec3(s * size * 0.5);
    }
    smooth_normals(p);
    return p;
  }

  void armchair() {
    const std::uint32_t velvet = material("velvet", srgb(0.23, 0.34, 0.47), 0.85f);
    const std::uint32_t mustard = material("mustard", srgb(0.80, 0.58, 0.18), 0.9f);
    const std::uint32_t oak = material("oak", srgb(0.50, 0.33, 0.19), 0.42f);
    Primitive p;
    append(p, cushion({0.66, 0.22, 0.70}, 0.05), translate(0, 0.27, 0));
    append(p, cushion({0.60, 0.17, 0.62}, 0.35), translate(0, 0.43, 0.04));
    append(p, cushion({0.66, 0.20, 0.70}, 0.10), translate(0, 0.62, -0.34) * rotate(kPi / 2 - 0.22, {1, 0, 0}));
    append(p, cushion({0.54, 0.15, 0.52}, 0.40), translate(0, 0.68, -0.22) * rotate(kPi / 2 - 0.26, {1, 0, 0}));
    for (const double side : {-1.0, 1.0})
      append(p, cushion({0.17, 0.42, 0.78}, 0.06), translate(side * 0.41, 0.40, 0.0));
    Primitive pillow = cushion({0.42, 0.15, 0.42}, 0.55);
    Primitive pillows;
    append(pillows, pillow,
           translate(0.10, 0.66, -0.06) * rotate(0.35, {0, 0, 1}) * rotate(kPi / 2 - 0.42, {1, 0, 0}) * rotate_y(0.75));
    Primitive feet;
    const glm::dvec2 foot[] = {{0, 0}, {0, 0}, {0.018, 0}, {0.022, 0.02}, {0.035, 0.16}, {0.035, 0.16}, {0, 0.16}};
    for (int i = 0; i < 4; ++i)
      append(feet, lathe(foot, cells(20, 6)), translate(i & 1 ? 0.32 : -0.32, 0, i & 2 ? 0.30 : -0.30));
    object("armchair", {{std::move(p), velvet}, {std::move(pillows), mustard}, {std::move(feet), oak}},
           {-2.15, 0, -1.62}, 0.75);
  }

  void bookshelf() {
    const std::uint32_t walnut = material("walnut", srgb(0.36, 0.23, 0.15), 0.5f);
    const double x0 = 0.55, x1 = 2.15, depth = 0.30, height = 2.12, board = 0.028;
    const double back = -kZ + 0.025, front = back + depth;
    const int fine = cells(1, 1);
    Primitive frame;
    append(frame, box({x0, 0.0, back - 0.005}, {x1, height, back + 0.005}));
    for (const double x : {x0, 0.5 * (x0 + x1) - board / 2, x1 - board})
      append(frame, rounded_box({x, 0, back}, {x + board, height, front}, 0.004, fine));
    constexpr int kShelves = 6;
    double levels[kShelves];
    for (int i = 0; i < kShelves; ++i) {
      levels[i] = 0.08 + i * (height - 0.08 - board) / (kShelves - 1);
      append(frame, rounded_box({x0, levels[i], back}, {x1, levels[i] + board, front + 0.004}, 0.004, fine));
    }
    append(frame,
           rounded_box({x0 - 0.03, height - 0.005, back}, {x1 + 0.03, height + 0.035, front + 0.03}, 0.012, fine));
    object("bookshelf", {{std::move(frame), walnut}});

    const glm::vec3 colors[] = {srgb(0.55, 0.16, 0.14), srgb(0.16, 0.26, 0.40), srgb(0.20, 0.35, 0.25),
                                srgb(0.72, 0.55, 0.25), srgb(0.40, 0.22, 0.32), srgb(0.78, 0.72, 0.60),
                                srgb(0.18, 0.18, 0.20), srgb(0.70, 0.38, 0.20)};
    constexpr std::size_t kColors = std::size(colors);
    std::vector<Primitive> covers(kColors);
    Primitive pages, bands;
    const auto book = [&](const glm::dmat4& place, double thick, double tall, double deep, std::size_t color) {
      // Spine towards +z; the block of pages stands back a little from the covers.
      append(covers[color], rounded_box({0, 0, 0}, {thick, tall, deep}, std::min(0.006, thick * 0.3), fine), place);
      append(pages, box({thick * 0.12, -0.0002, -0.0015}, {thick * 0.88, tall + 0.0012, deep * 0.9}), place);
      if (random_.uniform() < 0.6)
        for (const double h : {0.72, 0.80})
          append(bands, box({thick * 0.04, tall * h, deep}, {thick * 0.96, tall * h + 0.007, deep + 0.0012}), place);
    };
    for (int level = 0; level + 1 < kShelves; ++level)
      for (int bay = 0; bay < 2; ++bay) {
        double x = bay ? 0.5 * (x0 + x1) + board / 2 + 0.004 : x0 + board + 0.004;
        const double end = (bay ? x1 - board : 0.5 * (x0 + x1) - board / 2) - 0.004;
        const double y = levels[level] + board, room = levels[level + 1] - y;
        const int kind = (level * 2 + bay) % 5;
        const double stop = kind == 1 || kind == 3 ? end - 0.30 : kind == 4 ? end - 0.18 : end;
        while (true) {
          const double thick = random_.uniform(0.018, 0.050), tall = room * random_.uniform(0.62, 0.90),
                       deep = random_.uniform(0.17, 0.23);
          if (x + thick > stop) break;
          const double z = front - 0.03 - deep - random_.uniform(0, 0.02);
          // The last one before a gap leans on the others.
          const bool leans = stop < end && x + 2.2 * thick + 0.05 > stop;
          glm::dmat4 place = translate(x, y, z);
          if (leans) place = translate(x + tall * 0.20, y, z) * rotate(0.20, {0, 0, 1});
          book(place, thick, tall, deep, random_.below(kColors));
          x += thick + 0.001 + (leans ? 1.0 : 0.0);
        }
        const double gap = 0.5 * (stop + end) + 0.05;
        if (kind == 1) ornament_vase({gap, y, front - 0.15}, room * 0.75);
        if (kind == 3) {
          double h = y;  // a pile lying flat
          for (int i = 0; i < 3; ++i) {
            const double thick = random_.uniform(0.025, 0.045);
            book(translate(end - 0.02 - 0.005 * i, h, front - 0.24) * rotate(kPi / 2, {0, 0, 1}), thick,
                 random_.uniform(0.20, 0.23), 0.18, random_.below(kColors));
            h += thick + 0.001;
          }
          object("ball",
                 {{cube_sphere(cells(14, 3), [](const glm::dvec3&) { return 0.05; }),
                   material("lapis", srgb(0.12, 0.22, 0.55), 0.2f)}},
                 {end - 0.13, h + 0.05, front - 0.15});
        }
        if (kind == 4) {
          object("ring",
                 {{torus_knot(2, 3, 0.38, cells(110, 24), cells(14, 6)),
                   material("brass", srgb(0.80, 0.65, 0.38), 0.3f, 1.0f)}},
                 {end - 0.085, y + 0.085, front - 0.14}, 0.4);
          Node& ring = scene_.nodes.back();
          ring.scale = glm::dvec3(0.027);
          ring.rotation = ring.rotation * glm::angleAxis(kPi / 2, glm::dvec3(1, 0, 0));
        }
      }
    std::vector<Part> parts;
    for (std::size_t i = 0; i < kColors; ++i)
      if (!covers[i].triangles.empty())
        parts.emplace_back(std::move(covers[i]), material("book " + std::to_string(i + 1), colors[i], 0.6f));
    parts.emplace_back(std::move(pages), material("paper", srgb(0.90, 0.86, 0.76), 0.95f));
    parts.emplace_back(std::move(bands), material("gilt", srgb(0.83, 0.69, 0.36), 0.35f, 1.0f));
    object("books", std::move(parts));
  }

  void ornament_vase(const glm::dvec3& place, double height) {
    const double h = height;
    const glm::dvec2 profile[] = {{0, 0},
                                  {0, 0},
                                  {0.22 * h, 0},
                                  {0.24 * h, 0.03 * h},
                                  {0.36 * h, 0.25 * h},
                                  {0.38 * h, 0.45 * h},
                                  {0.26 * h, 0.70 * h},
                                  {0.12 * h, 0.82 * h},
                                  {0.11 * h, 0.90 * h},
                                  {0.17 * h, 1.0 * h},
                                  {0.15 * h, 1.0 * h},
                                  {0.09 * h, 0.90 * h},
                                  {0.10 * h, 0.80 * h},
                                  {0, 0.70 * h}};
    object("vase", {{lathe(profile, cells(48, 8), cells(4, 1)), material("terracotta", srgb(0.71, 0.36, 0.23), 0.55f)}},
           place);
  }

  void sideboard() {
    const std::uint32_t walnut = material("walnut", srgb(0.36, 0.23, 0.15), 0.5f);
    const std::uint32_t brass = material("brass", srgb(0.80, 0.65, 0.38), 0.3f, 1.0f);
    const int fine = cells(3, 1);
    const double x0 = -1.35, x1 = 0.05, z0 = -kZ + 0.03, z1 = -kZ + 0.46, top = 0.74;
    Primitive p, knobs;
    append(p, rounded_box({x0, 0.16, z0}, {x1, top, z1}, 0.012, fine));
    append(p, rounded_box({x0 - 0.02, top, z0}, {x1 + 0.02, top + 0.03, z1 + 0.02}, 0.012, fine));
    for (int i = 0; i < 3; ++i) {
      const double a = x0 + 0.03 + i * (x1 - x0 - 0.06) / 3, b = a + (x1 - x0 - 0.06) / 3 - 0.012;
      append(p, rounded_box({a, 0.20, z1 - 0.01}, {b, top - 0.03, z1 + 0.012}, 0.008, fine));
      append(knobs, sphere(0.016, cells(20, 6)), translate(0.5 * (a + b), 0.52, z1 + 0.026));
    }
    const glm::dvec2 leg[] = {{0, 0}, {0, 0}, {0.012, 0}, {0.024, 0.16}};
    for (int i = 0; i < 4; ++i)
      append(p, lathe(leg, cells(20, 6)), translate(i & 1 ? x1 - 0.07 : x0 + 0.07, 0, i & 2 ? z1 - 0.06 : z0 + 0.06));
    object("sideboard", {{std::move(p), walnut}, {std::move(knobs), brass}});

    // The sculpture: a displaced sphere on a plinth of stone.
    const double y = top + 0.03;
    const std::uint32_t stone = material("stone", srgb(0.30, 0.29, 0.28), 0.5f);
    object("plinth", {{rounded_box({-0.11, 0, -0.11}, {0.11, 0.05, 0.11}, 0.01, fine), stone}}, {-0.98, y, -kZ + 0.25},
           0.3);
    const std::uint32_t bronze = material("bronze", srgb(0.62, 0.44, 0.28), 0.35f, 1.0f);
    object("sculpture",
           {{cube_sphere(cells(50, 6),
                         [&](const glm::dvec3& d) {
                           const double ridge = 1 - std::abs(noise(d * 2.1, noise_seed_ + 40));
                           return 0.15 *
                                  (0.62 + 0.45 * ridge * ridge + 0.10 * fractal_noise(d * 5.0, 3, noise_seed_ + 41));
                         }),
             bronze}},
           {-0.98, y + 0.195, -kZ + 0.25});

    // Vase with dry stalks.
    const glm::dvec2 vase[] = {{0, 0},        {0, 0},        {0.055, 0},    {0.060, 0.01},  {0.085, 0.10},
                               {0.080, 0.19}, {0.040, 0.26}, {0.030, 0.30}, {0.042, 0.335}, {0.039, 0.336},
                               {0.026, 0.30}, {0.034, 0.25}, {0, 0.18}};
    Primitive stalks, ears;
    for (int i = 0; i < 11; ++i) {
      const double a = random_.uniform(0, 2 * kPi), lean = random_.uniform(0.05, 0.24),
                   tall = random_.uniform(0.50, 0.72);
      const auto curve = [=](double t) {
        return glm::dvec3(lean * t * t * std::cos(a), 0.24 + (tall - 0.24) * t, lean * t * t * std::sin(a));
      };
      append(stalks, tube(
                         curve, [](double) { return 0.0022; }, cells(6), cells(12, 2), true));
      append(ears,
             cube_sphere(cells(7, 2), [](const glm::dvec3& d) { return 0.014 * (1 + 0.35 * noise(d * 6.0, 11)); }),
             glm::translate(glm::dmat4(1.0), curve(1.0)) * scale(1, 2.6, 1));
    }
    object("dry flowers",
           {{lathe(vase, cells(56, 8), cells(4, 1)), material("celadon glaze", srgb(0.40, 0.60, 0.55), 0.15f)},
            {std::move(stalks), material("straw", srgb(0.62, 0.52, 0.30), 0.9f)},
            {std::move(ears), material("ears", srgb(0.80, 0.62, 0.38), 0.9f)}},
           {-0.20, y, -kZ + 0.22});
  }

  // ---------------------------------------------------------------------------------------------------- lamps and
  // plants

  void lamps() {
    const std::uint32_t brass = material("brass", srgb(0.80, 0.65, 0.38), 0.3f, 1.0f);
    const std::uint32_t shade = material("lamp shade", srgb(0.92, 0.84, 0.68), 0.9f);
    scene_.materials[shade].double_sided = true;
    scene_.materials[shade].emissive = {1.1f, 0.80f, 0.48f};
    // Floor lamp beside the armchair.
    const glm::dvec3 foot(-2.62, 0, -2.02);
    const glm::dvec2 base[] = {{0, 0},        {0, 0},        {0.15, 0},     {0.155, 0.012}, {0.14, 0.024},
                               {0.03, 0.036}, {0.012, 0.06}, {0.010, 0.10}, {0.010, 1.45}};
    Primitive stand = lathe(base, cells(40, 8), cells(2, 1));
    append(stand, sphere(0.02, cells(20, 6)), translate(0, 1.72, 0));
    const glm::dvec2 cone[] = {{0.235, 1.36}, {0.15, 1.70}};
    object("floor lamp", {{std::move(stand), brass}, {lathe(cone, cells(56, 8), cells(8, 1)), shade}}, foot);

    // Pendant over the table: a metal bell with a lamp inside.
    const glm::dvec3 hang(kTableX, 1.78, kTableZ);
    const std::uint32_t enamel = material("enamel", srgb(0.13, 0.25, 0.24), 0.3f);
    scene_.materials[enamel].double_sided = true;
    const glm::dvec2 bell[] = {{0.235, 0.0},  {0.225, 0.06}, {0.17, 0.13}, {0.07, 0.175},
                               {0.035, 0.20}, {0.030, 0.26}, {0, 0.265}};
    Primitive cord = tube([&](double t) { return glm::dvec3(0, 0.26 + t * (kY - hang.y - 0.26), 0); },
                          [](double) { return 0.005; }, cells(8, 5), 1, false);
    const glm::dvec2 rose[] = {{0.0, kY - hang.y - 0.03}, {0.03, kY - hang.y - 0.03}, {0.055, kY - hang.y}};
    append(cord, lathe(rose, cells(32, 8), cells(3, 1)));
    const std::uint32_t bulb = material("bulb", srgb(1.0, 0.9, 0.7), 0.9f);
    scene_.materials[bulb].emissive = {9.0f, 6.8f, 4.2f};
    Primitive globe;
    append(globe, sphere(0.05, cells(20, 6)), translate(0, 0.08, 0));
    object("pendant",
           {{lathe(bell, cells(64, 10), cells(5, 1)), enamel}, {std::move(cord), brass}, {std::move(globe), bulb}},
           hang);

    const auto light = [&](const Light& l) {
      scene_.lights.push_back(l);
      return static_cast<std::uint32_t>(scene_.lights.size() - 1);
    };
    Light lamp;
    lamp.name = "pendant";
    lamp.type = Light::Type::kPoint;
    lamp.color = {1.0f, 0.76f, 0.48f};
    lamp.intensity = 9.0f;
    // Below the rim: the shadow of the bell ends at the ceiling, not across the pictures.
    node("pendant light", hang + glm::dvec3(0, -0.10, 0)).light = light(lamp);

    Light floor;
    floor.name = "floor lamp";
    floor.type = Light::Type::kPoint;
    floor.color = {1.0f, 0.80f, 0.55f};
    floor.intensity = 5.0f;
    node("floor light", foot + glm::dvec3(0, 1.53, 0)).light = light(floor);

    Light sun;
    sun.name = "sun";
    sun.type = Light::Type::kSpot;
    sun.color = {1.0f, 0.88f, 0.68f};
    sun.intensity = 520.0f;
    sun.inner_cone = 0.40f;
    sun.outer_cone = 0.55f;
    const std::uint32_t sunlight = light(sun);
    Node& at = node("sun");
    at.light = sunlight;
    aim(at, {kView + 0.15, 4.2, 0.75}, {-3.0, 1.45, -0.25});

    // Shines away from the room, so that nothing in the room asks for it.
    Light outdoors;
    outdoors.name = "outdoors";
    outdoors.type = Light::Type::kSpot;
    outdoors.color = {0.95f, 0.97f, 1.0f};
    outdoors.intensity = 42.0f;
    outdoors.inner_cone = 1.10f;
    outdoors.outer_cone = 1.50f;
    const std::uint32_t daylight = light(outdoors);
    Node& sky = node("outdoors light");
    sky.light = daylight;
    aim(sky, {-3.3, 2.6, 0.5 * (kJambA + kJambB)}, {kView, 1.9, 0.5 * (kJambA + kJambB)});

    Light fill;
    fill.name = "ceiling lamp";
    fill.type = Light::Type::kPoint;
    fill.color = {1.0f, 0.93f, 0.82f};
    fill.intensity = 9.0f;
    node("ceiling light", {1.5, 2.45, 1.2}).light = light(fill);
  }

  void plant() {
    const std::uint32_t leaf = material("leaf", srgb(0.20, 0.40, 0.16), 0.55f);
    scene_.materials[leaf].double_sided = true;
    const std::uint32_t pot = material("terracotta", srgb(0.71, 0.36, 0.23), 0.55f);
    const glm::dvec2 profile[] = {{0, 0},       {0, 0},       {0.13, 0},    {0.13, 0},     {0.18, 0.30},
                                  {0.18, 0.30}, {0.20, 0.30}, {0.20, 0.30}, {0.205, 0.36}, {0.205, 0.36},
                                  {0.18, 0.36}, {0.18, 0.36}, {0.17, 0.31}};
    const glm::dvec2 soil[] = {{0.172, 0.32}, {0, 0.33}};
    Primitive leaves, stems;
    const int count = 46;
    for (int i = 0; i < count; ++i) {
      const double a = i * 2.39996 + random_.uniform(-0.2, 0.2), t0 = (i + 0.5) / count;
      const double reach = 0.30 + 0.32 * t0 * random_.uniform(0.7, 1.1),
                   rise = 1.05 - 0.65 * t0 + random_.uniform(-0.08, 0.08);
      const double wide = random_.uniform(0.045, 0.075), twist = random_.uniform(-0.3, 0.3);
      const glm::dvec3 out(std::cos(a), 0, std::sin(a)), side(-std::sin(a), 0, std::cos(a));
      const auto rib = [=](double t) {
        return glm::dvec3(0, 0.32, 0) + out * (0.02 + reach * t) +
               glm::dvec3(0, rise * t * (1 - 0.45 * t * t) - 0.25 * t * t * t, 0);
      };
      append(stems, tube([&](double t) { return rib(0.55 * t); }, [](double t) { return 0.006 - 0.003 * t; }, cells(6),
                         cells(8, 2), false));
      append(leaves, surface(cells(6, 2), cells(16, 3), [&](double u, double v) {
               const double t = 0.5 + 0.5 * v, s = 2 * u - 1;
               const double width = wide * std::pow(std::sin(kPi * std::clamp(0.03 + 0.97 * v, 0.0, 1.0)), 0.7);
               const glm::dvec3 fold(0, 0.35 * width * s * s + 0.01 * std::sin(18 * v) * s * s, 0);
               return rib(t) + (side + glm::dvec3(0, twist, 0)) * (width * s) + fold;
             }));
    }
    object("plant",
           {{lathe(profile, cells(48, 8)), pot},
            {lathe(soil, cells(32, 8)), material("soil", srgb(0.20, 0.14, 0.10), 1.0f)},
            {std::move(stems), material("stem", srgb(0.30, 0.38, 0.18), 0.7f)},
            {std::move(leaves), leaf}},
           {-2.42, 0, 0.72});
  }

  void pictures() {
    const std::uint32_t black = material("black frame", srgb(0.12, 0.11, 0.10), 0.4f);
    const std::uint32_t mat = material("passe-partout", srgb(0.95, 0.93, 0.88), 0.95f);
    const int fine = cells(3, 1);
    const auto hang = [&](const std::string& name, double x, double y, double w, double h, std::uint32_t painting) {
      const double z = -kZ + 0.003, rim = 0.028;
      Primitive frame;
      append(frame,
             rounded_box({x - w / 2 - rim, y - h / 2 - rim, z}, {x - w / 2, y + h / 2 + rim, z + 0.03}, 0.006, fine));
      append(frame,
             rounded_box({x + w / 2, y - h / 2 - rim, z}, {x + w / 2 + rim, y + h / 2 + rim, z + 0.03}, 0.006, fine));
      append(frame, rounded_box({x - w / 2, y - h / 2 - rim, z}, {x + w / 2, y - h / 2, z + 0.03}, 0.006, fine));
      append(frame, rounded_box({x - w / 2, y + h / 2, z}, {x + w / 2, y + h / 2 + rim, z + 0.03}, 0.006, fine));
      const double m = 0.14 * std::min(w, h);
      Primitive sheet = quad({x - w / 2 + m, y - h / 2 + m, z + 0.011}, {w - 2 * m, 0, 0}, {0, h - 2 * m, 0});
      for (glm::vec2& t : sheet.texcoords[0]) t.y = 1 - t.y;
      object(name, {{std::move(frame), black},
                    {quad({x - w / 2, y - h / 2, z + 0.010}, {w, 0, 0}, {0, h, 0}), mat},
                    {std::move(sheet), painting}});
    };
    const std::uint32_t hills = texture("hills", 256, 192, [&](double u, double v) {
      glm::dvec3 c = glm::mix(glm::dvec3(0.96, 0.80, 0.58), glm::dvec3(0.90, 0.55, 0.42), smooth(0.1, 0.6, v));
      if (std::hypot((u - 0.66) * 1.333, v - 0.36) < 0.12) c = glm::dvec3(0.98, 0.93, 0.78);
      for (int i = 0; i < 5; ++i) {
        const double edge = 0.45 + 0.11 * i + 0.08 * fractal_noise({u * (2.0 + i), 3.1 * i, 0.2}, 3, noise_seed_ + 50);
        if (v > edge) c = glm::mix(glm::dvec3(0.66, 0.46, 0.50), glm::dvec3(0.13, 0.18, 0.28), i / 4.0);
      }
      return c;
    });
    hang("large picture", -0.65, 1.66, 0.92, 0.70, textured("hills", hills, 0.9f));
    const std::uint32_t shapes = texture("shapes", 160, 224, [&](double u, double v) {
      glm::dvec3 c(0.93, 0.89, 0.80);
      if (std::hypot(u - 0.42, (v - 0.36) * 1.4) < 0.27) c = glm::dvec3(0.80, 0.36, 0.22);
      if (u > 0.30 && u < 0.80 && v > 0.48 && v < 0.86) c = glm::dvec3(0.17, 0.33, 0.37);
      if (std::hypot(u - 0.66, (v - 0.56) * 1.4) < 0.17) c = glm::dvec3(0.90, 0.70, 0.30);
      if (std::abs(u - 0.22 - 0.2 * v) < 0.012) c = glm::dvec3(0.10, 0.10, 0.12);
      return c;
    });
    hang("small picture", 0.22, 1.62, 0.36, 0.50, textured("shapes", shapes, 0.9f));
  }

  void camera() {
    Camera c;
    c.name = "camera";
    c.yfov = 0.80;
    c.aspect = 4.0 / 3.0;
    c.znear = 0.01;
    scene_.cameras.push_back(c);
    Node& n = node("camera");
    n.camera = 0;
    aim(n, {2.72, 1.62, 2.12}, {-0.72, 0.92, -0.98});
  }

  static constexpr double kTableX = -0.30, kTableZ = -0.10, kTableTop = 0.7505;
  static constexpr double kChairAngles[3] = {-0.85, 0.75,
                                             3.0};  // about y from +x; the table's far right is free for the view
  static constexpr double kChairReach[3] = {0.80, 0.66, 0.70};
  static constexpr double kChairTurn[3] = {0.35, -0.1, 0.12};

  double fineness_;
  Random random_;
  std::uint32_t noise_seed_;
  Scene scene_;
};

}  // namespace

Scene make_room(double detail, std::uint64_t seed) { return Room(detail, seed).make(); }

}  // namespace retrace
