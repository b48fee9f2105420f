// A controller in C++, on trial in standfast. This file needs nothing but C++17; copy it beside your own.
//
//     #include "standfast.hpp"
//
//     struct Mine : standfast::Controller {
//         using Controller::Controller;
//         standfast::Command tick(const standfast::Sensed&) override { return {robot.home_q_ref}; }
//     };
//
//     int main() { standfast::serve<Mine>(); }
//
// The guide's chapter process.md says what is read, and what may be answered.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace standfast {

constexpr int PROTOCOL = 1;

// A value of JSON, such as the parameters of the controller's file. What is not there, or of another kind, throws.
class Json {
public:
    explicit Json(const std::string& line) {
        const char* at = line.c_str();
        *this = read(at);
        if (next(at) != '\0') bad("the end", at);
    }

    bool has(const std::string& name) const { return find(name) != nullptr; }
    bool is_null() const { return kind == Kind::Null; }

    const Json& at(const std::string& name) const {
        if (const Json* found = find(name)) return *found;
        throw std::runtime_error("there is no \"" + name + "\"");
    }

    // true is 1, false is 0. null is NaN, since that is how a number that is not finite is sent.
    double number() const {
        if (kind != Kind::Number && kind != Kind::Null) wrong("a number");
        return number_;
    }

    const std::string& text() const {
        if (kind != Kind::Text) wrong("a text");
        return text_;
    }

    const std::vector<Json>& list() const {
        if (kind != Kind::List) wrong("a list");
        return list_;
    }

    std::vector<double> numbers() const {
        std::vector<double> all;
        all.reserve(list().size());
        for (const Json& one : list_) all.push_back(one.number());
        return all;
    }

private:
    enum class Kind { Null, Number, Text, List, Object } kind = Kind::Null;
    double number_ = std::numeric_limits<double>::quiet_NaN();
    std::string text_;
    std::vector<Json> list_;
    std::vector<std::pair<std::string, Json>> object;

    Json() = default;

    const Json* find(const std::string& name) const {
        for (const auto& [key, value] : object)
            if (key == name) return &value;
        return nullptr;
    }

    [[noreturn]] void wrong(const std::string& wanted) const {
        const char* found[] = {"null", "a number", "a text", "a list", "an object"};
        throw std::runtime_error("wanted " + wanted + ", found " + found[static_cast<int>(kind)] +
                                 (kind == Kind::Text ? ": " + text_ : ""));
    }

    [[noreturn]] static void bad(const std::string& wanted, const char* at) {
        throw std::runtime_error("no JSON: wanted " + wanted + " at: " + std::string(at).substr(0, 40));
    }

    static char next(const char*& at) {
        while (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r') ++at;
        return *at;
    }

    // Stops at the first difference, so that it cannot go beyond the end of the line.
    static void expect(const char*& at, const char* word) {
        next(at);
        for (const char* letter = word; *letter != '\0'; ++letter, ++at)
            if (*at != *letter) bad(word, at);
    }

    static Json read(const char*& at) {
        Json value;
        const auto is = [&value](Kind kind) { value.kind = kind; };
        switch (next(at)) {
        case '{':
            is(Kind::Object);
            for (++at; next(at) != '}';) {
                if (!value.object.empty()) expect(at, ",");
                std::string name = read_text(at);
                expect(at, ":");
                value.object.emplace_back(std::move(name), read(at));
            }
            ++at;
            break;
        case '[':
            is(Kind::List);
            for (++at; next(at) != ']';) {
                if (!value.list_.empty()) expect(at, ",");
                value.list_.push_back(read(at));
            }
            ++at;
            break;
        case '"': is(Kind::Text), value.text_ = read_text(at); break;
        case 't': is(Kind::Number), value.number_ = 1, expect(at, "true"); break;
        case 'f': is(Kind::Number), value.number_ = 0, expect(at, "false"); break;
        case 'n': expect(at, "null"); break;
        default: {
            char* end = nullptr;
            is(Kind::Number), value.number_ = std::strtod(at, &end);
            if (end == at) bad("a value", at);
            at = end;
        }
        }
        return value;
    }

    static std::string read_text(const char*& at) {
        std::string text;
        for (expect(at, "\""); *at != '"';) {
            if (*at == '\0') bad("the end of a text", at);
            if (*at != '\\') {
                text += *at++;
                continue;
            }
            const char letter = *++at;
            if (letter == 'u') {
                read_code(++at, text);
                continue;
            }
            const std::string from = "\"\\/bfnrt", to = "\"\\/\b\f\n\r\t";
            const auto which = from.find(letter);
            if (which == std::string::npos) bad("another letter after \\", at);
            text += to[which];
            ++at;
        }
        ++at;
        return text;
    }

    // The four hexadecimal digits after \u. Standfast writes characters of more than 16 bits as they are, in UTF-8.
    static void read_code(const char*& at, std::string& text) {
        unsigned code = 0;
        for (int i = 0; i < 4; ++i, ++at) {
            const auto digit = std::string("0123456789abcdef0123456789ABCDEF").find(*at);
            if (digit == std::string::npos) bad("a hexadecimal digit", at);
            code = code * 16 + static_cast<unsigned>(digit % 16);
        }
        if (code >= 0xD800 && code <= 0xDFFF) bad("a character of 16 bits", at);
        const auto add = [&text](unsigned byte) { text += static_cast<char>(byte); };
        if (code >= 0x800) add(0xE0 | code >> 12);
        if (code >= 0x80) add(code >= 0x800 ? 0x80 | (code >> 6 & 0x3F) : 0xC0 | code >> 6);
        add(code >= 0x80 ? 0x80 | (code & 0x3F) : code);
    }
};

struct Joint {
    std::string name;
    double lower_rad, upper_rad;  // infinite if there is no limit
    double torque_n_m, kp, kd, rotor_inertia_kg_m2, friction_n_m, damping_n_m_s_rad;
};

struct Link {
    std::string name;
    double mass_kg;
};

struct Robot {
    std::string name, trunk;  // the trunk is the link with the IMU
    double mass_kg, com_height_m;
    std::vector<Joint> joints;
    std::vector<Link> links;
    std::vector<double> home_q_ref, home_tau_ff;  // they hold the posture of the start
};

struct Sole {
    std::array<double, 3> force, moment;  // N, N m
};

// The readings of a tick, in the order of the robot's joints.
struct Sensed {
    double time_s;
    std::vector<double> q, dq;                  // rad, rad/s
    std::array<double, 4> orientation;          // of the trunk: w, x, y, z
    std::array<double, 3> gyro, accelerometer;  // rad/s, m/s^2, in the trunk's axes
    Sole left, right;
};

// What the servos are to do. If left empty, dq_ref and tau_ff are zero, and the gains are the robot's own.
struct Command {
    std::vector<double> q_ref = {}, dq_ref = {}, tau_ff = {};
    std::vector<std::array<double, 2>> gains = {};  // stiffness and damping of each joint
    std::string phase = "standing";
    std::map<std::string, double> numbers = {};  // for traces
};

// A controller of one robot. What its constructor throws is an error before the first episode.
struct Controller {
    explicit Controller(const Json& hello)
        : period_s(hello.at("period_s").number()), parameters(hello.at("parameters")) {
        const Json& told = hello.at("robot");
        robot.name = told.at("name").text();
        robot.trunk = told.at("trunk").text();
        robot.mass_kg = told.at("mass_kg").number();
        robot.com_height_m = told.at("com_height_m").number();
        const double none = std::numeric_limits<double>::infinity();
        const auto limit = [](const Json& of, double otherwise) { return of.is_null() ? otherwise : of.number(); };
        for (const Json& joint : told.at("joints").list())
            robot.joints.push_back({joint.at("name").text(), limit(joint.at("lower_rad"), -none),
                                    limit(joint.at("upper_rad"), none), joint.at("torque_n_m").number(),
                                    joint.at("kp").number(), joint.at("kd").number(),
                                    joint.at("rotor_inertia_kg_m2").number(),
                                    joint.at("friction_n_m").number(), joint.at("damping_n_m_s_rad").number()});
        for (const Json& link : told.at("links").list())
            robot.links.push_back({link.at("name").text(), link.at("mass_kg").number()});
        robot.home_q_ref = told.at("home").at("q_ref").numbers();
        robot.home_tau_ff = told.at("home").at("tau_ff").numbers();
    }
    virtual ~Controller() = default;

    // An episode begins. Forget the last one: an episode must depend on its own readings and its seed alone.
    virtual void reset(std::uint64_t /* seed */) {}

    // The command for these readings. What it throws ends the episode, and is told.
    virtual Command tick(const Sensed& sensed) = 0;

    Robot robot;
    double period_s;
    Json parameters;
};

namespace detail {

template <std::size_t N> std::array<double, N> fixed(const Json& value) {
    std::array<double, N> all{};
    if (value.list().size() != N) throw std::runtime_error("wanted a list of " + std::to_string(N) + " numbers");
    for (std::size_t i = 0; i < N; ++i) all[i] = value.list()[i].number();
    return all;
}

inline Sensed sensed(const Json& asked) {
    const auto sole = [](const Json& told) { return Sole{fixed<3>(told.at("force")), fixed<3>(told.at("moment"))}; };
    return {asked.at("time_s").number(),    asked.at("q").numbers(),       asked.at("dq").numbers(),
            fixed<4>(asked.at("orientation")), fixed<3>(asked.at("gyro")), fixed<3>(asked.at("accelerometer")),
            sole(asked.at("left")),         sole(asked.at("right"))};
}

// 17 digits give every double back to the bit. JSON has no numbers that are not finite.
inline void write(std::string& out, double number) {
    char digits[32];
    const int count = std::snprintf(digits, sizeof digits, "%.17g", number);
    out.append(std::isfinite(number) ? std::string(digits, static_cast<std::size_t>(count)) : "null");
}

inline void write(std::string& out, const std::string& text) {
    out += '"';
    for (const char letter : text) {
        if (letter == '"' || letter == '\\') out += '\\';
        // A line feed would end the answer too early.
        out += static_cast<unsigned char>(letter) < 0x20 ? ' ' : letter;
    }
    out += '"';
}

template <typename List> void write_list(std::string& out, const std::string& name, const List& list) {
    out += '[';
    for (std::size_t i = 0; i < list.size(); ++i) {
        if (!std::isfinite(list[i]))
            throw std::runtime_error(name + "[" + std::to_string(i) + "] is " + std::to_string(list[i]));
        if (i > 0) out += ',';
        write(out, list[i]);
    }
    out += ']';
}

inline std::string line(const Command& command) {
    std::string out = "{\"q_ref\":";
    write_list(out, "q_ref", command.q_ref);
    if (!command.dq_ref.empty()) write_list(out += ",\"dq_ref\":", "dq_ref", command.dq_ref);
    if (!command.tau_ff.empty()) write_list(out += ",\"tau_ff\":", "tau_ff", command.tau_ff);
    if (!command.gains.empty()) {
        for (std::size_t i = 0; i < command.gains.size(); ++i)
            write_list(out += i == 0 ? ",\"gains\":[" : ",", "gains[" + std::to_string(i) + "]", command.gains[i]);
        out += ']';
    }
    write(out += ",\"phase\":", command.phase);
    out += ",\"numbers\":{";
    const char* between = "";
    for (const auto& [name, number] : command.numbers) {
        write(out += between, name);
        write(out += ':', number);
        between = ",";
    }
    return out + "}}";
}

inline std::string error(const std::string& problem) {
    std::string out = "{\"error\":";
    write(out, problem);
    return out + "}";
}

}  // namespace detail

// Answers standfast until it closes the pipe. What a controller writes to std::cout goes to std::cerr, so that it does
// not get between the answers; it must not use printf, nor another locale, in which numbers may have a comma.
template <typename Mine> void serve() {
    std::ios::sync_with_stdio(false);
    std::cout.rdbuf(std::cerr.rdbuf());
    std::unique_ptr<Controller> controller;
    std::string line, answer;
    while (std::getline(std::cin, line)) {
        try {
            const Json asked(line);
            const std::string& type = asked.at("type").text();
            if (type == "hello") {
                controller = std::make_unique<Mine>(asked);
                answer = "{\"type\":\"hello\",\"protocol\":" + std::to_string(PROTOCOL) + "}";
            } else if (!controller) {
                throw std::runtime_error("the first line was no greeting");
            } else if (type == "reset") {
                controller->reset(std::stoull(asked.at("seed").text()));
                answer = "{\"type\":\"ready\"}";
            } else if (type == "tick") {
                answer = detail::line(controller->tick(detail::sensed(asked)));
            } else {
                throw std::runtime_error("asked for something unknown: " + type);
            }
        } catch (const std::exception& problem) {
            answer = detail::error(problem.what());
        } catch (...) {
            answer = detail::error("something was thrown that is no std::exception");
        }
        answer += '\n';
        std::fwrite(answer.data(), 1, answer.size(), stdout);
        std::fflush(stdout);
    }
}

}  // namespace standfast
