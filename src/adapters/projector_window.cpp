#include "weldcell/adapters/projector_window.hpp"

#include <SDL.h>
#include <cairo.h>

#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>

#include "cairo_renderer.hpp"

namespace weldcell::adapters {
namespace {

struct DestroyWindow {
  void operator()(SDL_Window* window) const { SDL_DestroyWindow(window); }
};

bool set(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

Error no_display(const std::string& what) {
  return {"projector.no_display", "projector", what,
          "pictures are kept as files; for a window, start with a display"};
}

}  // namespace

struct ProjectorWindow::State {
  std::unique_ptr<SDL_Window, DestroyWindow> window;
  std::optional<guidance::Drawing> shown;

  ~State() {
    window.reset();
    SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }
  Status repaint();
};

ProjectorWindow::ProjectorWindow(std::unique_ptr<State> state) : state_(std::move(state)) {}
ProjectorWindow::ProjectorWindow(ProjectorWindow&&) noexcept = default;
ProjectorWindow& ProjectorWindow::operator=(ProjectorWindow&&) noexcept = default;
ProjectorWindow::~ProjectorWindow() = default;

Result<ProjectorWindow> ProjectorWindow::open(const ProjectorWindowOptions& options) {
  if (!set("DISPLAY") && !set("WAYLAND_DISPLAY") && !set("SDL_VIDEODRIVER"))
    return no_display("neither DISPLAY nor WAYLAND_DISPLAY is set");
  // SIGTERM belongs to the daemon, and a projector must not go dark.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_VIDEO_ALLOW_SCREENSAVER, "0");
  if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0) return no_display(SDL_GetError());
  auto state = std::make_unique<State>();
  // Asked for nothing, SDL may settle for a driver that draws into memory.
  const std::string driver = SDL_GetCurrentVideoDriver();
  if (!set("SDL_VIDEODRIVER") && (driver == "offscreen" || driver == "dummy"))
    return no_display("nothing answers DISPLAY or WAYLAND_DISPLAY");
  const int displays = SDL_GetNumVideoDisplays();
  if (options.display < 0 || options.display >= displays)
    return Error{
        "projector.window", "projector",
        "display " + std::to_string(options.display) + " is not there; there are " + std::to_string(displays),
        "choose the projector's display"};
  SDL_Rect area{0, 0, 1280, 720};
  SDL_GetDisplayBounds(options.display, &area);
  const int place = static_cast<int>(SDL_WINDOWPOS_CENTERED_DISPLAY(static_cast<unsigned>(options.display)));
  const Uint32 flags = options.full_screen ? SDL_WINDOW_FULLSCREEN_DESKTOP : SDL_WINDOW_RESIZABLE;
  state->window.reset(SDL_CreateWindow("weldcell projector", place, place,
                                       options.full_screen ? area.w : area.w / 2,
                                       options.full_screen ? area.h : area.h / 2, flags));
  if (!state->window)
    return Error{"projector.window", "projector", SDL_GetError(), "check the display's settings"};
  if (options.full_screen) SDL_ShowCursor(SDL_DISABLE);
  ProjectorWindow out(std::move(state));
  out.blank();
  return out;
}

Status ProjectorWindow::State::repaint() {
  SDL_Surface* screen = SDL_GetWindowSurface(window.get());
  if (screen == nullptr)
    return Error{"projector.window", "projector", SDL_GetError(), "check the display and its cable"};
  const int width = screen->w, height = screen->h;
  const bool direct = screen->format->format == SDL_PIXELFORMAT_RGB888 && !SDL_MUSTLOCK(screen);
  SDL_Surface* target =
      direct ? screen : SDL_CreateRGBSurfaceWithFormat(0, width, height, 32, SDL_PIXELFORMAT_RGB888);
  if (target == nullptr) return Error{"projector.window", "projector", SDL_GetError(), "free memory"};
  cairo_surface_t* surface = cairo_image_surface_create_for_data(
      static_cast<unsigned char*>(target->pixels), CAIRO_FORMAT_RGB24, width, height, target->pitch);
  cairo_t* cr = cairo_create(surface);
  paint(cr, shown.value_or(guidance::Drawing{}), width, height);
  cairo_destroy(cr);
  cairo_surface_destroy(surface);
  if (!direct) {
    SDL_BlitSurface(target, nullptr, screen, nullptr);
    SDL_FreeSurface(target);
  }
  if (SDL_UpdateWindowSurface(window.get()) != 0)
    return Error{"projector.window", "projector", SDL_GetError(), "check the display and its cable"};
  return Done{};
}

Status ProjectorWindow::show(const guidance::Drawing& drawing) {
  state_->shown = drawing;
  return state_->repaint();
}

void ProjectorWindow::blank() {
  state_->shown.reset();
  static_cast<void>(state_->repaint());
}

void ProjectorWindow::pump() {
  bool stale = false;
  for (SDL_Event event; SDL_PollEvent(&event) != 0;) {
    if (event.type != SDL_WINDOWEVENT) continue;
    stale = stale || event.window.event == SDL_WINDOWEVENT_EXPOSED ||
            event.window.event == SDL_WINDOWEVENT_SIZE_CHANGED;
  }
  if (stale) static_cast<void>(state_->repaint());
}

int ProjectorWindow::width_px() const {
  int width = 0;
  SDL_GetWindowSize(state_->window.get(), &width, nullptr);
  return width;
}

int ProjectorWindow::height_px() const {
  int height = 0;
  SDL_GetWindowSize(state_->window.get(), nullptr, &height);
  return height;
}

}  // namespace weldcell::adapters
