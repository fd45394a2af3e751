// The module that picture_codec() loads: everything the project asks of OpenImageIO.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>

#include "golden/base/error.hpp"
#include "golden/base/output_file.hpp"
#include "golden/picture/picture_codec.hpp"

namespace retrace {
namespace {

OIIO::TypeDesc type_of(Sample sample) {
  switch (sample) {
    case Sample::kByte:
      return OIIO::TypeDesc::UINT8;
    case Sample::kWord:
      return OIIO::TypeDesc::UINT32;
    default:
      return OIIO::TypeDesc::FLOAT;
  }
}

std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

/// An open writer whose file is in memory.
class Encoder {
 public:
  explicit Encoder(const PictureFile& file)
      : file_(file), proxy_(bytes_), writer_(OIIO::ImageOutput::create(file.format)) {
    if (!writer_) fail(OIIO::geterror());
    OIIO::ImageSpec spec(file.width, file.height, file.channels, type_of(file.sample));
    if (!file.channel_names.empty()) {
      spec.channelnames = file.channel_names;
    } else if (file.channels == 1) {
      spec.channelnames = {"Y"};
    }
    spec.attribute("Software", "retrace");
    spec.attribute("oiio:ColorSpace", file.linear ? "Linear" : "sRGB");
    if (file.linear) spec.attribute("compression", "zip");
    std::string name = file.path.string();
    // TIFF seeks behind the end, which OpenImageIO 2.4's file in a vector does not bear.
    if (writer_->supports("ioproxy") && file.format != "tiff") {
      void* proxy = &proxy_;
      spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    } else {
      // Such a writer wants a name and does not say when its file is cut short. A file in memory never is, but by a limit.
      constexpr std::uint64_t kFrame = 65536;  // what a format adds to the pixels at most
      rlimit limit{};
      if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && spec.image_bytes() + kFrame > limit.rlim_cur)
        fail(std::generic_category().message(EFBIG));
      memory_ = ::memfd_create("picture", MFD_CLOEXEC);
      if (memory_ < 0) fail(std::generic_category().message(errno));
      name = "/proc/self/fd/" + std::to_string(memory_);
    }
    if (!writer_->open(name, spec)) fail(writer_->geterror());
  }
  ~Encoder() {
    writer_.reset();
    if (memory_ >= 0) ::close(memory_);
  }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  std::string encode(OIIO::TypeDesc type, const void* pixels) {
    if (!writer_->write_image(type, pixels)) fail(writer_->geterror());
    if (!writer_->close()) fail(writer_->geterror());
    std::string bytes(reinterpret_cast<const char*>(bytes_.data()), bytes_.size());
    if (memory_ >= 0) {
      bytes.clear();
      if (const int error = read_memory_file(memory_, bytes); error != 0) fail(std::generic_category().message(error));
    }
    check_readable(bytes);
    return bytes;
  }

 private:
  /// Some writers report success for what no reader takes (JPEG 2000 of few pixels).
  void check_readable(std::string& bytes) const {
    const auto reader = OIIO::ImageInput::create(writer_->format_name());
    if (!reader) return;
    OIIO::ImageSpec config, seen;
    OIIO::Filesystem::IOMemReader memory(bytes.data(), bytes.size());
    std::string name = "picture";
    if (reader->supports("ioproxy")) {
      void* proxy = &memory;
      config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    } else if (memory_ >= 0) {
      name = "/proc/self/fd/" + std::to_string(memory_);
    } else {
      return;
    }
    if (!reader->open(name, seen, config)) fail(reader->geterror());
    if (seen.width != file_.width || seen.height != file_.height)
      fail("the format does not take a picture of this size");
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw Error("cannot write " + file_.path.string() + ": " + (why.empty() ? "the format does not take it" : why));
  }

  const PictureFile& file_;
  std::vector<unsigned char> bytes_;
  OIIO::Filesystem::IOVecOutput proxy_;
  int memory_ = -1;
  std::unique_ptr<OIIO::ImageOutput> writer_;
};

class OiioCodec final : public PictureCodec {
 public:
  std::string writer_of(const std::string& extension) const override {
    const auto writer = OIIO::ImageOutput::create("picture" + extension);
    std::string name = writer ? writer->format_name() : "";
    if (!name.empty() && name != "null" && name != "term") return name;  // those two write no file
    (void)OIIO::geterror();
    return "";
  }

  std::string encode(const PictureFile& file, Sample given, const void* pixels) const override {
    Encoder encoder(file);
    return pixels == nullptr ? std::string() : encoder.encode(type_of(given), pixels);
  }

  std::vector<std::uint8_t> encode_png(int width, int height, int channels, const std::uint8_t* pixels,
                                       const std::vector<std::pair<std::string, int>>& attributes) const override {
    std::vector<std::uint8_t> encoded;
    OIIO::Filesystem::IOVecOutput sink(encoded);
    const auto output = OIIO::ImageOutput::create("png");
    OIIO::ImageSpec spec(width, height, channels, OIIO::TypeDesc::UINT8);
    for (const auto& [name, value] : attributes) spec.attribute(name, value);
    if (!output || !output->set_ioproxy(&sink) || !output->open("memory.png", spec) ||
        !output->write_image(OIIO::TypeDesc::UINT8, pixels) || !output->close())
      throw Error(output ? output->geterror() : OIIO::geterror());
    return encoded;
  }

  DecodedPicture decode(const std::string& format, std::span<const std::uint8_t> file,
                        const std::function<void(int, int, int)>& admit) const override {
    OIIO::Filesystem::IOMemReader reader(const_cast<std::uint8_t*>(file.data()), file.size());
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(format);
    if (!input) throw Error("cannot be decoded: " + one_line(OIIO::geterror()));
    OIIO::ImageSpec config, spec;
    config.attribute("oiio:UnassociatedAlpha", 1);
    if (!input->set_ioproxy(&reader) || !input->open("memory." + format, spec, config))
      throw Error("cannot be decoded: " + one_line(input->geterror()));
    admit(spec.width, spec.height, spec.nchannels);
    DecodedPicture picture;
    picture.width = spec.width;
    picture.height = spec.height;
    picture.channels = std::min(spec.nchannels, 4);
    picture.sample = spec.format == OIIO::TypeDesc::UINT8 ? Sample::kByte : Sample::kFloat;
    const std::size_t count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                              static_cast<std::size_t>(picture.channels);
    void* samples = nullptr;
    if (picture.sample == Sample::kByte) {
      picture.bytes.resize(count);
      samples = picture.bytes.data();
    } else {
      picture.floats.resize(count);
      samples = picture.floats.data();
    }
    if (!input->read_image(0, 0, 0, picture.channels, type_of(picture.sample), samples))
      throw Error("cannot be decoded: " + one_line(input->geterror()));
    return picture;
  }

  std::vector<glm::vec3> color_map(const std::string& name, std::span<const float> values) const override {
    OIIO::ImageBuf ramp(OIIO::ImageSpec(static_cast<int>(values.size()), 1, 1, OIIO::TypeFloat));
    for (std::size_t i = 0; i < values.size(); ++i) ramp.setpixel(static_cast<int>(i), 0, &values[i]);
    const OIIO::ImageBuf mapped = OIIO::ImageBufAlgo::color_map(ramp, 0, name);
    if (mapped.has_error()) throw Error("colour map: " + mapped.geterror());
    std::vector<glm::vec3> colors(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) mapped.getpixel(static_cast<int>(i), 0, &colors[i].x, 3);
    return colors;
  }
};

}  // namespace
}  // namespace retrace

extern "C" __attribute__((visibility("default"))) const retrace::PictureCodec* retrace_picture_codec() {
  static const retrace::OiioCodec codec;
  return &codec;
}
