#include "weldcell/adapters/projector_png.hpp"

#include <cairo.h>

#include <cstdio>
#include <memory>

#include "cairo_renderer.hpp"

namespace weldcell::adapters {
namespace {

constexpr int kMostPixels = 8192;

struct Destroy {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* cr) const { cairo_destroy(cr); }
};

}  // namespace

Status write_png(const guidance::Drawing& drawing, const std::filesystem::path& path) {
  const int width = drawing.width_px, height = drawing.height_px;
  if (width <= 0 || height <= 0 || width > kMostPixels || height > kMostPixels)
    return Error{
        "projector.size", path.string(),
        "a picture of " + std::to_string(width) + " x " + std::to_string(height) + " pixels cannot be made",
        "correct projector.resolution in the cell file"};
  const std::unique_ptr<cairo_surface_t, Destroy> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  {
    const std::unique_ptr<cairo_t, Destroy> cr(cairo_create(surface.get()));
    paint(cr.get(), drawing, width, height);
  }
  const std::filesystem::path half = path.string() + ".tmp";
  const cairo_status_t written = cairo_surface_write_to_png(surface.get(), half.c_str());
  if (written != CAIRO_STATUS_SUCCESS || std::rename(half.c_str(), path.c_str()) != 0) {
    std::remove(half.c_str());
    return Error{
        "projector.io", path.string(),
        written != CAIRO_STATUS_SUCCESS ? cairo_status_to_string(written) : "cannot be renamed into place",
        "check that the folder exists and the disk has room"};
  }
  return Done{};
}

}  // namespace weldcell::adapters
