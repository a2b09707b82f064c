// SIGTERM, SIGINT and SIGUSR1 ask a training to stop at the next step with a checkpoint (status 75).
#pragma once

namespace mocap::train {

void catch_stop_signals();  // a second SIGINT ends the process at once
bool stop_requested();
void request_stop();        // as a signal would; for tests
void clear_stop_request();  // for tests

}  // namespace mocap::train
