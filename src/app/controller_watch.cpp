#include "weldcell/app/controller_watch.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace weldcell::app {

namespace {

constexpr int kMostFramesAStep = 32;
constexpr std::size_t kMostEventsAStep = 5;
constexpr std::size_t kMostEventsKept = 100;

}  // namespace

void ControllerWatch::step(HostTime now) {
  if (socket_) receive();
  if (!lost_.empty()) lose(lost_, now);
  if (now >= next_look_) look(now);
  if (!socket_ && view_.reachable && now >= next_try_) subscribe(now);
}

void ControllerWatch::receive() {
  std::string frame;
  for (int i = 0; i < kMostFramesAStep; ++i) {
    const auto event = socket_->receive(frame, 0);
    if (event == adapters::RwsSocket::Event::Nothing) return;
    if (event == adapters::RwsSocket::Event::Closed) {
      lost_ = socket_->reason();
      return;
    }
    const wire::RwsNews news = wire::rws_news(frame);
    if (news.controller) view_.controller = *news.controller;
    if (news.mode) view_.mode = *news.mode;
    if (news.execution) view_.execution = *news.execution;
    if (news.controller) view_.detail = adapters::to_string(view_.controller);
    std::size_t asked = 0;
    for (auto n = news.log_entries.rbegin(); n != news.log_entries.rend() && asked < kMostEventsAStep;
         ++n, ++asked) {
      auto entry = client_->event(*n);
      if (entry.ok() && events_.size() < kMostEventsKept) events_.push_back(std::move(*entry));
    }
  }
}

void ControllerWatch::subscribe(HostTime now) {
  retry_ = retry_ == 0 ? options_.first_retry : std::min(2 * retry_, options_.last_retry);
  next_try_ = now + retry_;
  // Generation 1 gives a client two groups: the lost one is ended first, whether or not it still exists.
  if (!group_.empty()) static_cast<void>(client_->unsubscribe(std::exchange(group_, {})));
  const wire::RwsDialect& dialect = client_->dialect();
  const auto made =
      client_->subscribe({dialect.controller_state_resource(), dialect.operation_mode_resource(),
                          dialect.execution_resource(), dialect.event_log_resource()});
  if (!made.ok()) {
    spdlog::warn("robot controller: no subscription, it is asked every {:.0f} s instead: {}",
                 seconds(options_.look), made.error().text());
    return;
  }
  group_ = made->group;
  http_->take_turn();
  auto opened = adapters::RwsSocket::open(http_->access(), made->poll, http_->cookie_header());
  if (!opened.ok()) {
    spdlog::warn("robot controller: {}", opened.error().text());
    return;
  }
  socket_ = std::move(*opened);
  ++subscriptions_;
  view_.live = true;
  retry_ = 0;
  // What changed between the last look and the subscription is asked for once.
  next_look_ = next_full_look_ = now;
}

void ControllerWatch::lose(const std::string& why, HostTime now) {
  spdlog::info("robot controller: {}; the subscription is made anew", why);
  lost_.clear();
  socket_.reset();
  view_.live = false;
  view_.execution = adapters::ExecutionState::Unknown;
  next_look_ = next_full_look_ = now;
  next_try_ = now;
}

void ControllerWatch::look(HostTime now) {
  next_look_ = now + options_.look;
  const auto state = client_->controller_state();
  view_.reachable = state.ok();
  if (!state.ok()) {
    view_.detail = state.error().text();
    view_.controller = adapters::ControllerState::Unknown;
    view_.execution = adapters::ExecutionState::Unknown;
    if (socket_) lost_ = "it does not answer";
    return;
  }
  view_.controller = *state;
  view_.detail = adapters::to_string(*state);
  if (now < next_full_look_) return;
  next_full_look_ = now + (socket_ ? options_.full_look : options_.look);
  if (const auto mode = client_->operation_mode(); mode.ok()) view_.mode = *mode;
  if (const auto execution = client_->execution_state(); execution.ok()) view_.execution = *execution;
}

std::vector<adapters::ControllerEvent> ControllerWatch::take_events() {
  std::ranges::sort(events_, {}, &adapters::ControllerEvent::number);
  return std::exchange(events_, {});
}

}  // namespace weldcell::app
