// What a person is told, from any thread: Maya shows it when it is idle, and a batch writes it to the error stream.
#pragma once

#include <string>

namespace notice {

void start();           // on Maya's main thread, when the plug-in is loaded
bool on_main_thread();  // where Maya's windows may be used
void warning(const std::string &text);
void error(const std::string &text);

}  // namespace notice
