// Runs the sketch by the test's orders, one in a line: "t 3" lets 3 ms pass, "b 4a0a" receives characters, "c 0 352" sets
// what an analogue pin reads. After each order it prints the characters that the sketch has sent, and the pulses.
#include "Arduino.h"

static unsigned long now = 0;
static unsigned char received[1 << 16];
static size_t first = 0, last = 0;
static int counts[6];
static char sent[1 << 16];
static size_t sent_size = 0;

long map(long value, long from_low, long from_high, long to_low, long to_high) {
    return (value - from_low) * (to_high - to_low) / (from_high - from_low) + to_low;
}
int analogRead(uint8_t pin) { return counts[pin - A0]; }
unsigned long millis() { return now; }

Port Serial;
void Port::begin(unsigned long) {}
int Port::available() { return (int)(last - first); }
int Port::read() { return first < last ? received[first++] : -1; }
size_t Port::write(const char *text, size_t size) {
    memcpy(sent + sent_size, text, size);
    sent_size += size;
    return size;
}

void Servo::attach(int to) { pin = to; }
void Servo::write(int value) { pulse = value < 544 ? (int)map(constrain(value, 0, 180), 0, 180, 544, 2400) : value; }
void Servo::writeMicroseconds(int value) { pulse = value; }

#include SKETCH

int main() {
    char order[1 << 16];
    setup();
    while (fgets(order, sizeof order, stdin) != NULL) {
        int first_number = 0, second_number = 0;
        if (sscanf(order, "t %d", &first_number) == 1) {
            for (int i = 0; i < first_number; i++) {
                now++;
                loop();
            }
        } else if (sscanf(order, "c %d %d", &first_number, &second_number) == 2) {
            counts[first_number] = second_number;
        } else {
            first = last = 0;
            unsigned byte;
            for (char *at = order + 2; sscanf(at, "%2x", &byte) == 1; at += 2) received[last++] = (unsigned char)byte;
            while (first < last) loop();
        }
        for (size_t i = 0; i < sent_size; i++) printf("%02x", (unsigned char)sent[i]);
        sent_size = 0;
        for (int i = 0; i < COUNT; i++) printf(" %d", servos[i].pin < 0 ? 0 : servos[i].pulse);
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
