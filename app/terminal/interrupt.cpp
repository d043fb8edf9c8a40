#include "app/terminal/interrupt.h"

#include <csignal>

namespace sqslam::app {
namespace {

volatile std::sig_atomic_t interrupted = 0;  // a signal handler can reach nothing but a global

void Handle(int) { interrupted = 1; }

void Install(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART | (handler == SIG_DFL ? 0 : static_cast<int>(SA_RESETHAND));
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

InterruptGuard::InterruptGuard() {
  interrupted = 0;
  Install(Handle);
}
InterruptGuard::~InterruptGuard() { Install(SIG_DFL); }
bool InterruptGuard::Interrupted() const { return interrupted != 0; }

}  // namespace sqslam::app
