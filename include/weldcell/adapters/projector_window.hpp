// The projector as a full-screen window (SDL2). Make, use and destroy it on one thread, the projector thread.
#pragma once

#include <memory>

#include "weldcell/base/result.hpp"
#include "weldcell/base/time.hpp"
#include "weldcell/guidance/drawing.hpp"

namespace weldcell::adapters {

struct ProjectorWindowOptions {
  int display = 0;          ///< index of the display that is the projector
  bool full_screen = true;  ///< false: a plain window of the drawing's size, for a desk
};

class ProjectorWindow {
 public:
  /// Code "projector.no_display" when neither DISPLAY nor WAYLAND_DISPLAY is there or nothing answers it: a
  /// normal state of a cell without a screen. "projector.window" for any other failure. SDL_VIDEODRIVER=dummy
  /// is honoured for tests.
  static Result<ProjectorWindow> open(const ProjectorWindowOptions& options = {});
  ProjectorWindow(ProjectorWindow&&) noexcept;
  ProjectorWindow& operator=(ProjectorWindow&&) noexcept;
  ~ProjectorWindow();

  /// Shows the drawing, unscaled when its size is the display's, else scaled to fit and centred.
  Status show(const guidance::Drawing& drawing);
  /// Black.
  void blank();
  /// Answers the window system and repaints after exposure. Call at least every 100 ms.
  void pump();
  int width_px() const;
  int height_px() const;

 private:
  struct State;
  explicit ProjectorWindow(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace weldcell::adapters
