// As much of Arduino as the paddle's sketch uses, around a simulated mass with viscous friction.
//
// Standard input: commands, each with the time [s] at which it is sent, as `0.5 sweep 1 100 900 50`. Arguments of the
// program: seconds to run, mass [kg], friction [N s/m]. Time passes only while the board asks for it: every micros()
// takes a tick of 4 us, through which the motor's force is constant and the motion of the mass exact.
#ifndef ARDUINO_STUB
#define ARDUINO_STUB
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#define constrain(value, low, high) ((value) < (low) ? (low) : (value) > (high) ? (high) : (value))
#define max(a, b) ((a) > (b) ? (a) : (b))
enum { LOW, HIGH, OUTPUT, A2 = 16 };

namespace simulated {
const double TICK = 4e-6, STEP = 1.1861e-5, FULL = 3.876;
const int TURN = 980, START = 600;
double mass, friction, position, velocity;
unsigned long ticks;
int duty, direction;

double seconds() { return TICK * ticks; }

void advance() {
  static const double decay = std::exp(-friction / mass * TICK);
  const double force = (direction == HIGH ? 1 : -1) * FULL * (duty / 255.0) * (duty / 255.0);
  const double last = force / friction;  // the velocity that the force would end in
  position += last * TICK + (velocity - last) * (1 - decay) * mass / friction;
  velocity = last + (velocity - last) * decay;
  ++ticks;
}

struct Command {
  double at;
  std::string text;
};
std::vector<Command> commands;
size_t next;
}  // namespace simulated

inline void pinMode(int, int) {}
inline void analogWrite(int, int value) { simulated::duty = value; }
inline void digitalWrite(int, int value) { simulated::direction = value; }
inline unsigned long micros() {
  simulated::advance();
  return 4 * simulated::ticks;
}
inline int analogRead(int) {
  const long steps = std::lround(simulated::position / simulated::STEP) + simulated::START;
  return (int)(((steps % simulated::TURN) + simulated::TURN) % simulated::TURN);
}

struct SerialPort {
  size_t taken = 0;
  void begin(long) {}
  int available() {
    if (simulated::next >= simulated::commands.size()) return 0;
    const simulated::Command &command = simulated::commands[simulated::next];
    return command.at <= simulated::seconds() ? (int)(command.text.size() - taken) : 0;
  }
  int read() {
    const std::string &text = simulated::commands[simulated::next].text;
    const char letter = text[taken++];
    if (taken == text.size()) taken = 0, ++simulated::next;
    return letter;
  }
  void print(const char *text) { std::fputs(text, stdout); }
  void print(char letter) { std::putchar(letter); }
  void print(double number, int digits) { std::printf("%.*f", digits, number); }
  void println(const char *text) { std::puts(text); }
  void println(int number) { std::printf("%d\n", number); }
  void println(double number, int digits) { print(number, digits), std::puts(""); }
};
static SerialPort Serial;

void setup();
void loop();

int main(int count, char **arguments) {
  if (count != 4) return 2;
  const double duration = std::atof(arguments[1]);
  simulated::mass = std::atof(arguments[2]);
  simulated::friction = std::atof(arguments[3]);
  char line[100], text[100];
  double at;
  while (std::fgets(line, sizeof line, stdin)) {
    if (std::sscanf(line, "%lf %99[^\n]", &at, text) != 2) return 2;
    simulated::commands.push_back({at, std::string(text) + "\n"});
  }
  setup();
  while (simulated::seconds() < duration) loop();
  return 0;
}
#endif
