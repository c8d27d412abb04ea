// What the projector shows, pixel by pixel where it matters; the window with SDL's dummy driver.
#include <cairo.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "weldcell/adapters/projector_png.hpp"
#include "weldcell/adapters/projector_window.hpp"

// Read by the sanitizers where they are linked. The font libraries keep what they loaded until the process
// ends, and they hand it between their own threads by means that the thread sanitizer does not see.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig\nleak:libdbus-1\n"; }
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "race:libpangoft2\nrace:libpango\nrace:libfontconfig\nrace:libglib\nrace:FcValueSave\n";
}

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;
using guidance::Colour;

struct Destroy {
  void operator()(cairo_surface_t* s) const { cairo_surface_destroy(s); }
};

class Picture {
 public:
  explicit Picture(const fs::path& path) : surface_(cairo_image_surface_create_from_png(path.c_str())) {}
  int width() const { return cairo_image_surface_get_width(surface_.get()); }
  int height() const { return cairo_image_surface_get_height(surface_.get()); }
  unsigned at(int x, int y) const {
    const unsigned char* row =
        cairo_image_surface_get_data(surface_.get()) + y * cairo_image_surface_get_stride(surface_.get());
    return reinterpret_cast<const unsigned*>(row)[x] & 0xFFFFFF;
  }
  int lit(int x0, int y0, int x1, int y1) const {
    int count = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) count += at(x, y) != 0 ? 1 : 0;
    return count;
  }

 private:
  std::unique_ptr<cairo_surface_t, Destroy> surface_;
};

bool near(unsigned a, unsigned b) {
  for (int shift = 0; shift < 24; shift += 8)
    if (std::abs(static_cast<int>(a >> shift & 0xFF) - static_cast<int>(b >> shift & 0xFF)) > 2) return false;
  return true;
}

guidance::Drawing step_drawing() {
  guidance::Drawing d;
  d.width_px = 848;
  d.height_px = 480;
  const auto box = [](double x0, double y0, double x1, double y1) {
    return std::vector<Vec2>{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  };
  d.lines.push_back({box(100, 60, 150, 430), true, 2, Colour::Placed});
  d.lines.push_back({box(150, 215, 690, 265), true, 4, Colour::Place});
  for (const double x : {260.0, 580.0}) {
    std::vector<Vec2> circle;
    for (int i = 0; i < 48; ++i)
      circle.push_back({x + 24 * std::cos(i * 0.1309), 291 + 24 * std::sin(i * 0.1309)});
    d.lines.push_back({circle, true, 3, Colour::Fixture});
  }
  d.texts.push_back({{424, 36}, "Place member 3: rung_1", 32, Colour::Text});
  d.texts.push_back({{420, 240}, "3", 36, Colour::Place});
  d.texts.push_back({{125, 245}, "1", 28, Colour::Placed});
  d.texts.push_back({{424, 450}, "magnet M4 lies outside the picture", 22, Colour::Warning});
  return d;
}

class ProjectorPng : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/weldcell-png-XXXXXX";
    ASSERT_NE(::mkdtemp(name), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    if (std::getenv("WELDCELL_KEEP_PICTURES") == nullptr) fs::remove_all(folder_);
  }
  fs::path folder_;
};

TEST_F(ProjectorPng, ShowsTheStepOnBlack) {
  const fs::path path = folder_ / "step.png";
  ASSERT_TRUE(write_png(step_drawing(), path).ok());
  const Picture picture(path);
  ASSERT_EQ(picture.width(), 848);
  ASSERT_EQ(picture.height(), 480);
  EXPECT_EQ(picture.at(5, 5), 0u) << "black ground: a projector has no other dark";
  EXPECT_EQ(picture.at(800, 400), 0u);
  EXPECT_TRUE(near(picture.at(424, 215), 0x33FF59)) << "outline of the member to place";
  EXPECT_TRUE(near(picture.at(100, 100), 0x738CA6)) << "outline of a member placed";
  EXPECT_TRUE(near(picture.at(260, 315), 0xFF9E0D)) << "fixture";
  EXPECT_GT(picture.lit(200, 20, 650, 52), 1500) << "the title is there";
  EXPECT_EQ(picture.lit(0, 0, 848, 10), 0) << "nothing cut at the upper edge";
  EXPECT_FALSE(fs::exists(path.string() + ".tmp"));
}

TEST_F(ProjectorPng, ATextLongerThanThePictureIsWrapped) {
  guidance::Drawing d;
  d.width_px = 400;
  d.height_px = 200;
  d.texts.push_back(
      {{200, 100}, "Member rail_L lies outside of the picture on the left side", 30, Colour::Warning});
  ASSERT_TRUE(write_png(d, folder_ / "text.png").ok());
  const Picture picture(folder_ / "text.png");
  EXPECT_EQ(picture.lit(0, 0, 6, 200), 0);
  EXPECT_EQ(picture.lit(394, 0, 400, 200), 0);
  EXPECT_GT(picture.lit(0, 100, 400, 200), 500) << "a second line";
}

TEST_F(ProjectorPng, SickDrawingsDoNoHarm) {
  guidance::Drawing d;
  d.width_px = 64;
  d.height_px = 64;
  d.lines.push_back({{}, true, 3, Colour::Place});
  d.lines.push_back({{{NAN, 1}, {2, 2}}, false, 3, Colour::Place});
  d.lines.push_back({{{-1e9, 32}, {1e9, 32}}, false, 1e9, Colour::Place});
  d.texts.push_back({{NAN, 0}, "x", 20, Colour::Text});
  d.texts.push_back({{32, 32}, "\xFF\xFE", 1e9, Colour::Text});
  EXPECT_TRUE(write_png(d, folder_ / "sick.png").ok());
}

TEST_F(ProjectorPng, RefusesWhatIsNoPicture) {
  guidance::Drawing d;
  EXPECT_EQ(write_png(d, folder_ / "a.png").error().code, "projector.size");
  d.width_px = 100'000;
  d.height_px = 10;
  EXPECT_EQ(write_png(d, folder_ / "a.png").error().code, "projector.size");
  EXPECT_EQ(write_png(step_drawing(), folder_ / "none/a.png").error().code, "projector.io");
}

TEST(ProjectorWindow, NoDisplayIsAStateAndNoFailure) {
  ::unsetenv("DISPLAY");
  ::unsetenv("WAYLAND_DISPLAY");
  ::unsetenv("SDL_VIDEODRIVER");
  const auto window = ProjectorWindow::open();
  ASSERT_FALSE(window.ok());
  EXPECT_EQ(window.error().code, "projector.no_display");
  ::setenv("DISPLAY", ":4711", 1);
  EXPECT_EQ(ProjectorWindow::open().error().code, "projector.no_display");
  ::unsetenv("DISPLAY");
}

TEST(ProjectorWindow, ShowsBlanksAndCloses) {
  ::setenv("SDL_VIDEODRIVER", "dummy", 1);
  {
    auto window = ProjectorWindow::open();
    ASSERT_TRUE(window.ok()) << window.error().text();
    EXPECT_GT(window->width_px(), 0);
    EXPECT_GT(window->height_px(), 0);
    EXPECT_TRUE(window->show(step_drawing()).ok());
    window->pump();
    window->blank();
  }
  ProjectorWindowOptions absent;
  absent.display = 9;
  EXPECT_EQ(ProjectorWindow::open(absent).error().code, "projector.window");
  ::unsetenv("SDL_VIDEODRIVER");
}

}  // namespace
}  // namespace weldcell::adapters
