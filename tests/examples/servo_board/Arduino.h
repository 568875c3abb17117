// As much of Arduino's core and of its Servo library as the sketch uses, on the test's machine.
#pragma once
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define constrain(value, low, high) ((value) < (low) ? (low) : ((value) > (high) ? (high) : (value)))
const uint8_t A0 = 14;

long map(long value, long from_low, long from_high, long to_low, long to_high);
int analogRead(uint8_t pin);
unsigned long millis();

struct Port {
    void begin(unsigned long baud);
    int available();
    int read();
    size_t write(const char *text, size_t size);
};
extern Port Serial;

struct Servo {
    int pulse = 1500;
    int pin = -1;
    void attach(int pin);
    void write(int value);
    void writeMicroseconds(int value);
};
