// Five joints and a gripper of hobby servos, which take the pose of the robot's arm.
//
// For an Arduino Uno or a board like it, with `farsteer servo-bridge` at the other end of the cable; the lines are
// described in docs/servos.md. The servos need a supply of their own (5 to 6 V, 5 A); only its ground goes to the board.
// Before the first start put the arm into the pose that the robot shows: without feedback wires the board cannot know
// where it stands.

#include <Servo.h>

const uint8_t COUNT = 6;                                  // five joints from the base, and the gripper
const uint8_t PINS[COUNT] = {3, 5, 6, 9, 10, 11};         // of the servos' signals
const int16_t LOWER[COUNT] = {-90, -45, -135, -90, -90, 0}; // angles at the servos' 0 degrees; at 180 they are 180 more
const bool TURNED[COUNT] = {false, false, false, false, false, false}; // servos that are mounted the other way round

// Whole degrees, as with Servo.write: the tip of this arm is off by 3.4 mm (rms). Else microseconds: 0.3 mm.
#ifndef WHOLE_DEGREES
#define WHOLE_DEGREES 1
#endif

// Whether the potentiometers of the servos are wired to A0 ... A5, as in servos that are sold with a feedback wire, and
// what they read at 0 and at 180 degrees. Without, the board answers what it has written.
#ifndef FEEDBACK
#define FEEDBACK 0
#endif
const int16_t COUNTS[COUNT][2] = {{100, 600}, {100, 600}, {100, 600}, {100, 600}, {100, 600}, {100, 600}};

const uint8_t FRAME = 20;    // ms between two pulses of a servo
const int16_t FASTEST = 40;  // tenths of a degree a frame: 200 degrees/s, as the robot's arm
const int16_t RANGE = 1800;  // tenths of a degree of a servo
const uint8_t LONGEST = 60;  // characters of a line

Servo servos[COUNT];
int16_t target[COUNT];  // where the servos shall be, in tenths of a degree of theirs
int16_t written[COUNT]; // where they are sent in this frame
bool moving = false;    // whether they get pulses; not before the first good line

char line[LONGEST];
uint8_t length = 0;
bool too_long = false;
const char *refusal = NULL; // why the last refused line of this frame was refused
uint8_t refused_joint = 0;
uint16_t refused = 0; // lines since the start
uint32_t last_frame = 0;

// CRC-16/XMODEM. A sum would miss lost characters: the receive buffer of an Uno holds 64, and loses what comes beyond.
uint16_t crc(const char *text, uint8_t size) {
    uint16_t value = 0;
    for (uint8_t i = 0; i < size; i++) {
        value ^= (uint16_t)(uint8_t)text[i] << 8;
        for (uint8_t bit = 0; bit < 8; bit++) value = value & 0x8000 ? (value << 1) ^ 0x1021 : value << 1;
    }
    return value;
}

void send(char *text, uint8_t size) {
    size += snprintf(text + size, 7, "*%04X\n", (unsigned)crc(text, size));
    Serial.write(text, size);
}

int16_t measured(uint8_t i) {
    long tenths = map(analogRead(A0 + i), COUNTS[i][0], COUNTS[i][1], 0, RANGE);
    tenths = constrain(tenths, 0L, (long)RANGE);
    return TURNED[i] ? RANGE - tenths : tenths;
}

void refuse(const char *why, uint8_t joint = 0) {
    refusal = why;
    refused_joint = joint;
    refused++;
}

// Reads a number with one decimal, such as -12.5, and the character behind it, or returns NULL.
const char *number(const char *at, char behind, int16_t *tenths) {
    bool negative = *at == '-';
    if (negative) at++;
    int16_t value = 0;
    uint8_t digits = 0;
    for (; *at >= '0' && *at <= '9'; at++, digits++) {
        if (digits == 3) return NULL;
        value = 10 * value + (*at - '0');
    }
    if (digits == 0 || *at++ != '.' || *at < '0' || *at > '9') return NULL;
    value = 10 * value + (*at++ - '0');
    if (*at++ != behind) return NULL;
    *tenths = negative ? -value : value;
    return at;
}

// Takes a line such as "J 0.0 60.0 -90.0 0.0 -30.0 180.0*78F7"; one that is not exactly so moves nothing.
void read_line() {
    char sum[6];
    if (length < 5) return refuse("form");
    uint8_t size = length - 5;
    snprintf(sum, sizeof sum, "*%04X", (unsigned)crc(line, size));
    if (memcmp(sum, line + size, 5) != 0) return refuse("checksum");
    int16_t wanted[COUNT];
    const char *at = line + 2;
    if (size < 2 || line[0] != 'J' || line[1] != ' ') return refuse("form");
    for (uint8_t i = 0; i < COUNT; i++) {
        at = number(at, i < COUNT - 1 ? ' ' : '*', &wanted[i]);
        if (at == NULL) return refuse("form");
        wanted[i] -= 10 * LOWER[i];
    }
    if (at != line + size + 1) return refuse("form");
    for (uint8_t i = 0; i < COUNT; i++) {
        if (wanted[i] < 0 || wanted[i] > RANGE) return refuse("range", i + 1);
    }
    memcpy(target, wanted, sizeof target);
    if (moving) return;
    // From where it stands; without feedback wires it can only be hoped that it stands where it is wanted.
    for (uint8_t i = 0; i < COUNT; i++) written[i] = FEEDBACK ? measured(i) : target[i];
}

void write_servo(uint8_t i) {
    int16_t tenths = TURNED[i] ? RANGE - written[i] : written[i];
    if (WHOLE_DEGREES) servos[i].write((tenths + 5) / 10);
    else servos[i].writeMicroseconds(544 + ((long)tenths * (2400 - 544) + RANGE / 2) / RANGE);
}

void take(char character) {
    if (character != '\n') {
        if (length == LONGEST) too_long = true;
        else line[length++] = character;
        return;
    }
    bool was_moving = moving;
    uint16_t before = refused;
    if (too_long) refuse("length");
    else if (length > 0) {
        read_line();
        moving = moving || refused == before;
    }
    length = 0;
    too_long = false;
    if (moving && !was_moving) {
        for (uint8_t i = 0; i < COUNT; i++) {
            write_servo(i); // before attach(): so the first pulse is the right one
            servos[i].attach(PINS[i]);
        }
    }
}

void answer() {
    char text[LONGEST];
    if (refusal != NULL) {
        uint8_t size = snprintf(text, 20, "E %s", refusal);
        if (refused_joint > 0) size += snprintf(text + size, 5, " %u", (unsigned)refused_joint);
        size += snprintf(text + size, 8, " %u", (unsigned)refused);
        send(text, size);
        refusal = NULL;
    }
    if (!moving && !FEEDBACK) return;
    uint8_t size = snprintf(text, 2, FEEDBACK ? "A" : "W");
    for (uint8_t i = 0; i < COUNT; i++) {
        int16_t tenths = (FEEDBACK ? measured(i) : written[i]) + 10 * LOWER[i];
        unsigned whole = abs(tenths) / 10, part = abs(tenths) % 10;
        size += snprintf(text + size, 9, " %s%u.%u", tenths < 0 ? "-" : "", whole, part);
    }
    send(text, size);
}

void setup() {
    Serial.begin(115200);
    char text[LONGEST];
    Serial.write("\n", 1); // ends the line that a reset has cut
    send(text, snprintf(text, 12, "R servos %u", (unsigned)COUNT));
    last_frame = millis();
}

void loop() {
    while (Serial.available() > 0) {
        take(Serial.read());
        if (millis() - last_frame >= FRAME) break; // a flood must not keep the servos from moving
    }
    if (millis() - last_frame < FRAME) return;
    last_frame += FRAME;
    for (uint8_t i = 0; moving && i < COUNT; i++) {
        written[i] += constrain(target[i] - written[i], -FASTEST, FASTEST);
        write_servo(i);
    }
    answer();
}
