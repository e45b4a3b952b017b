// A virtual wall on a paddle of one axis, and a sweep that finds the stiffness at which it becomes unstable.
//
// For boards of the Hapkit kind: an ATmega328, a magnetic sensor on the pulley, a motor behind an H bridge. It needs
// no library. Commands over the serial port, 115200 baud, one a line, SI units:
//
//     wall K B                 a wall that begins where the paddle is now and pushes towards negative x; wall 0 0: none
//     sweep B K0 K1 STEP       trials at damping B, stiffness from K0 to K1, until one is unstable
//     stop                     motor off; so does any line during a sweep
//
// It answers in lines that docs/paddle.md describes: `sample t x f`, `trial K B verdict frequency_Hz`, `#` and words.
// Wall law of a trial, every period T:  f = -(K (x - x0) + B (x - x of the period before) / T)

// --- the device: measure these of your own ---------------------------------------------------------------------
const int PIN_SENSOR = A2;
const int PIN_PWM = 5;
const int PIN_DIRECTION = 8;
const int POSITIVE = HIGH;             // level of PIN_DIRECTION that pushes towards positive x
const float METRES_PER_COUNT = 1.1861e-5f;  // of the handle: 0.070 m from the axis, 0.0097086 degrees a count
const int COUNTS_PER_TURN = 980;       // after which the sensor begins again
const float FORCE_AT_FULL_N = 3.876f;  // 0.03 N m of the motor, 9.044 turns of it a turn of the paddle, 0.070 m
const float LARGEST_FORCE_N = 3.5f;    // asked of the motor

// --- the loop and the trial -------------------------------------------------------------------------------------
const unsigned long PERIOD_US = 1000;
const float PERIOD_S = 1e-6f * PERIOD_US;
const int KICK_PERIODS = 5;        // a push at the start of a trial
const float KICK_N = 1.0f;
const int WINDOW = 100;            // periods over which the largest excursion is taken
const int TRIAL_WINDOWS = 6;
const int PAUSE_PERIODS = 300;     // between trials, motor off: it cools
const float AT_REST_M = 1.5e-4f;   // excursions below are sensor steps and friction
const float CROSSING_M = 4e-5f;    // beyond which the side of the middle is believed
const float TOO_FAR_M = 0.015f;    // a trial ends here
const int SAMPLE_EVERY = 10;       // periods

#ifdef __AVR__
const unsigned long TICKS_PER_US = 8;  // setup() makes timer 0, which micros() counts, 8 times faster
#else
const unsigned long TICKS_PER_US = 1;
#endif

unsigned long due;          // tick at which the next period begins
unsigned int lateBegins;    // periods that began late
long counts;                // of the sensor since the start, turns included
int lastRaw;
float x, lastX;             // m
float force;                // N, what the motor was given
float wallStiffness, wallDamping, wallStart;
unsigned long period;       // since the start

// --- sensor and motor -------------------------------------------------------------------------------------------

void readPosition() {
  int raw = analogRead(PIN_SENSOR);
  int step = raw - lastRaw;
  if (step > COUNTS_PER_TURN / 2) step -= COUNTS_PER_TURN;
  if (step < -COUNTS_PER_TURN / 2) step += COUNTS_PER_TURN;
  lastRaw = raw;
  counts += step;
  lastX = x;
  x = counts * METRES_PER_COUNT;
}

// The bridge's torque grows with the square of the duty.
void push(float wanted) {
  force = constrain(wanted, -LARGEST_FORCE_N, LARGEST_FORCE_N);
  digitalWrite(PIN_DIRECTION, (force > 0) == (POSITIVE == HIGH) ? HIGH : LOW);
  analogWrite(PIN_PWM, (int)(255.0f * sqrt(fabs(force) / FORCE_AT_FULL_N) + 0.5f));
}

void waitForPeriod() {
  if ((long)(micros() - due) > 0) {
    ++lateBegins;
    due = micros();
  }
  while ((long)(micros() - due) < 0) {
  }
  due += TICKS_PER_US * PERIOD_US;
  ++period;
}

// --- lines ------------------------------------------------------------------------------------------------------

// One number a period: printing a whole line at once takes longer than a period has left.
void printSample() {
  static float sampleX, sampleForce;
  static bool begun = false;
  begun = begun || period % SAMPLE_EVERY == 0;
  if (!begun) return;
  switch (period % SAMPLE_EVERY) {
    case 0:
      Serial.print("sample ");
      Serial.print(period * PERIOD_S, 3);
      sampleX = x;
      sampleForce = force;
      break;
    case 1:
      Serial.print(' ');
      Serial.print(sampleX, 6);
      break;
    case 2:
      Serial.print(' ');
      Serial.println(sampleForce, 3);
      break;
  }
}

void printTrial(float stiffness, float damping, bool unstable, float frequency) {
  Serial.print("trial ");
  Serial.print(stiffness, 2);
  Serial.print(' ');
  Serial.print(damping, 4);
  Serial.print(unstable ? " unstable " : " stable ");
  Serial.println(frequency, 2);
}

// Periods with the motor off, until the next sample may begin.
void rest(int periods) {
  push(0);
  for (int k = 0; k < periods || period % SAMPLE_EVERY != SAMPLE_EVERY - 1; ++k) {
    waitForPeriod();
    readPosition();
    printSample();
  }
}

// --- a trial ----------------------------------------------------------------------------------------------------

// Zero crossings of an oscillation, from the first to the last; one that comes late, after more than twice the mean
// time between two, is that of the slow motion left when the oscillation has died out.
struct Crossings {
  int side, number;
  unsigned long first, last;
  bool over;

  void add(float excursion) {
    int now = excursion > CROSSING_M ? 1 : excursion < -CROSSING_M ? -1 : side;
    over = over || (number > 1 && (period - last) * (number - 1) > 2 * (last - first));
    if (over || now == side) return;
    if (side != 0) {
      last = period;
      if (number++ == 0) first = period;
    }
    side = now;
  }

  float frequency() const { return number < 3 ? 0 : (number - 1) / (2 * (last - first) * PERIOD_S); }
};

// Push the paddle off its place and watch. Unstable: it goes too far, or in the last window swings more than after the
// push, or there asks for more force than the motor has, since such a vibration stays at one size. A trial that a line
// from the computer ends has no verdict, and ends the sweep as an unstable one does.
bool runTrial(float stiffness, float damping) {
  readPosition();
  const float middle = x;
  Crossings crossings = {0, 0, 0, 0, false};
  float early = 0, late = 0;
  bool saturated = false, tooFar = false;
  lastX = x;
  for (int k = 0; k < WINDOW * TRIAL_WINDOWS && !tooFar; ++k) {
    if (Serial.available()) {
      rest(0);
      return true;
    }
    waitForPeriod();
    readPosition();
    const float wanted = -(stiffness * (x - middle) + damping * (x - lastX) / PERIOD_S);
    push(k < KICK_PERIODS ? wanted + KICK_N : wanted);
    printSample();
    const float excursion = x - middle;
    crossings.add(excursion);
    tooFar = fabs(excursion) > TOO_FAR_M;
    if (k < WINDOW) early = max(early, (float)fabs(excursion));
    if (k >= WINDOW * (TRIAL_WINDOWS - 1)) {
      late = max(late, (float)fabs(excursion));
      saturated = saturated || fabs(wanted) > LARGEST_FORCE_N;
    }
  }
  const bool unstable = tooFar || saturated || (late > early && late > AT_REST_M);
  rest(PAUSE_PERIODS);
  printTrial(stiffness, damping, unstable, crossings.frequency());
  return unstable;
}

void sweep(float damping, float from, float to, float step) {
  wallStiffness = wallDamping = 0;
  rest(0);
  lateBegins = 0;
  bool unstable = false;
  // counted, since a sum of many steps in single precision drifts
  for (long k = 0; from + k * step <= to * 1.000001f && !unstable; ++k) {
    unstable = runTrial(from + k * step, damping);
  }
  Serial.print("# sweep ended, periods that began late: ");
  Serial.println((int)lateBegins);
}

// --- commands ---------------------------------------------------------------------------------------------------

void obey(char *line) {
  const char *name = strtok(line, " ");
  float numbers[4] = {0, 0, 0, 0};
  int given = 0;
  for (const char *word; given < 4 && (word = strtok(NULL, " ")) != NULL;) numbers[given++] = atof(word);
  const bool negative = numbers[0] < 0 || numbers[1] < 0;
  if (name == NULL) return;
  if (strcmp(name, "stop") == 0) {
    wallStiffness = wallDamping = 0;
  } else if (strcmp(name, "wall") == 0 && given == 2 && !negative) {
    wallStiffness = numbers[0];
    wallDamping = numbers[1];
    wallStart = x;
  } else if (strcmp(name, "sweep") == 0 && given == 4 && !negative && numbers[2] >= numbers[1] && numbers[3] > 0) {
    sweep(numbers[0], numbers[1], numbers[2], numbers[3]);
  } else {
    Serial.println("# not understood; commands: wall K B, sweep B K0 K1 STEP with K0 <= K1 and STEP > 0, stop");
  }
}

// One character a period, so that a long line delays none.
void readCommand() {
  static char line[64];
  static unsigned int length = 0;
  if (!Serial.available()) return;
  const char next = Serial.read();
  if (next != '\n' && next != '\r') {
    if (length < sizeof line - 1) line[length++] = next;
    return;
  }
  line[length] = 0;
  length = 0;
  obey(line);
}

void setup() {
#ifdef __AVR__
  TCCR0B = (TCCR0B & 0xF8) | 0x02;  // 7.8 kHz of pulses for the motor: those of 1 kHz would beat with the loop
#endif
  pinMode(PIN_PWM, OUTPUT);
  pinMode(PIN_DIRECTION, OUTPUT);
  Serial.begin(115200);
  Serial.print("#zwidth 1 period_s=");
  Serial.println(PERIOD_S, 6);
  lastRaw = analogRead(PIN_SENSOR);
  due = micros();
}

void loop() {
  waitForPeriod();
  readPosition();
  const float depth = x - wallStart;
  const float wanted = -(wallStiffness * depth + wallDamping * (x - lastX) / PERIOD_S);
  push(depth > 0 && wanted < 0 ? wanted : 0);  // a wall does not pull
  printSample();
  readCommand();
}
