#include "golden/shader/assembler.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>

namespace retrace::shader {
namespace {

constexpr std::string_view kLanes = "xyzw";
constexpr std::uint32_t kEveryLane = (1u << kMaskBits) - 1;
constexpr std::uint32_t kAlways = (1u << kClassesBits) - 1;
constexpr std::uint32_t kIdentity = 0 | 1 << 2 | 2 << 4 | 3 << 6;
constexpr int kImmediateShift = kExponentBits + kFractionBits + 1 - (kABits - 1);
constexpr std::uint32_t kSlotsOfSources = 3;

const OpEntry* find_op(std::string_view name) {
  const auto at = std::ranges::find(kOpTable, name, &OpEntry::name);
  return at == kOpTable.end() ? nullptr : &*at;
}
const OpEntry* op_of(std::uint32_t code) {
  const auto at = std::ranges::find(kOpTable, code, &OpEntry::code);
  return at == kOpTable.end() ? nullptr : &*at;
}
const SecondEntry* second_of(std::uint32_t code) {
  const auto at = std::ranges::find(kSecondTable, code, &SecondEntry::code);
  return at == kSecondTable.end() ? nullptr : &*at;
}
const RegisterEntry* register_of(std::uint32_t code) {
  const auto at = std::ranges::find(kRegisterTable, code, &RegisterEntry::code);
  return at == kRegisterTable.end() ? nullptr : &*at;
}
bool is_arithmetic(const OpEntry& op) { return op.kind == OpKind::Arithmetic || op.kind == OpKind::Dot; }

// -------------------------------------------------------------------------------------------------------------------
// tokens

enum class TokenKind { kWord, kNumber, kSymbol, kEnd };
struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::string_view text;
  int line = 1, column = 1;
  bool is(std::string_view symbol) const { return kind == TokenKind::kSymbol && text == symbol; }
  bool word(std::string_view name) const { return kind == TokenKind::kWord && text == name; }
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::vector<Token> tokens_of(std::string_view text, std::string_view file) {
  std::vector<Token> tokens;
  int line = 1;
  std::size_t start_of_line = 0, at = 0;
  const auto column = [&](std::size_t place) { return static_cast<int>(place - start_of_line) + 1; };
  while (at < text.size()) {
    const char c = text[at];
    if (c == '\n') {
      ++line;
      start_of_line = ++at;
    } else if (c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v') {
      ++at;
    } else if (c == ';' || text.substr(at, 2) == "//") {
      at = std::min(text.find('\n', at), text.size());
    } else if (is_letter(c)) {
      std::size_t end = at;
      while (end < text.size() && (is_letter(text[end]) || is_digit(text[end]))) ++end;
      tokens.push_back({TokenKind::kWord, text.substr(at, end - at), line, column(at)});
      at = end;
    } else if (is_digit(c) || (c == '.' && at + 1 < text.size() && is_digit(text[at + 1]))) {
      std::size_t end = at;
      if (text.substr(at, 2) == "0x") {
        end += 2;
        while (end < text.size() && (is_letter(text[end]) || is_digit(text[end]))) ++end;
      } else {
        while (end < text.size() && is_digit(text[end])) ++end;
        if (end < text.size() && text[end] == '.') {
          ++end;
          while (end < text.size() && is_digit(text[end])) ++end;
        }
        if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
          std::size_t power = end + 1;
          if (power < text.size() && (text[power] == '+' || text[power] == '-')) ++power;
          if (power < text.size() && is_digit(text[power])) {
            while (power < text.size() && is_digit(text[power])) ++power;
            end = power;
          }
        }
      }
      tokens.push_back({TokenKind::kNumber, text.substr(at, end - at), line, column(at)});
      at = end;
    } else {
      std::size_t length = 0;
      for (const std::string_view symbol :
           {">=", "<=", "==", "!=", "(", ")", "+", "-", "*", ":", ",", ".", "<", ">", "="}) {
        if (text.substr(at, symbol.size()) == symbol) {
          length = symbol.size();
          break;
        }
      }
      if (length == 0) {
        char shown[16];
        const auto byte = static_cast<unsigned char>(c);
        std::snprintf(shown, sizeof shown, byte >= 32 && byte < 127 ? "'%c'" : "byte 0x%02x", byte);
        throw AssemblyError(file, line, column(at), std::string("expected an instruction, found ") + shown);
      }
      tokens.push_back({TokenKind::kSymbol, text.substr(at, length), line, column(at)});
      at += length;
    }
  }
  tokens.push_back({TokenKind::kEnd, "", line, column(at)});
  return tokens;
}

// -------------------------------------------------------------------------------------------------------------------
// instructions

struct Place {  // where a jump goes
  std::string label;
  Token token;
};

/// One operation of an instruction, before pairing.
struct Operation {
  Token token;
  const OpEntry* op = nullptr;  // of a first operation
  std::uint32_t modifier = kModifierNone, component = 0, target = 0, mask = 0;
  std::vector<Source> sources;
  std::uint32_t second = kSecondNone;  // of a secondary one, or where store has its address
  std::uint32_t payload = 0;
  std::optional<Place> place;
  std::uint32_t classes = kAlways, lanes = kEveryLane, all = 0;
  bool conditional() const { return classes != kAlways || lanes != kEveryLane || all != 0; }
};

using Lanes = std::map<std::uint32_t, std::uint32_t>;  // register to components

Lanes lanes_read(const Operation& operation) {
  Lanes lanes;
  for (std::size_t s = 0; s < operation.sources.size(); ++s) {
    const Source& source = operation.sources[s];
    if (source.immediate) continue;
    std::uint32_t wanted = operation.op->kind == OpKind::Arithmetic ? operation.mask : kEveryLane;
    if (operation.op->code == kOpDp3 || (operation.op->code == kOpDp3h && s == 1)) wanted = 7;
    if (operation.op->code == kOpDp2h) wanted = s == 0 ? 7 : 3;
    for (std::uint32_t c = 0; c < 4; ++c)
      if (wanted >> c & 1) lanes[source.index] |= 1u << (source.swizzle >> 2 * c & 3);
  }
  if (operation.second == kSecondTrace) {
    for (const int e : {kRegisterE0, kRegisterE1, kRegisterE2}) lanes[static_cast<std::uint32_t>(e)] = kEveryLane;
  }
  if (operation.second == kSecondLoad || operation.second == kSecondLoad4x || operation.second == kSecondStore) {
    const auto code = decode_load(operation.payload).address;
    const auto at = std::ranges::find(kAddressTable, code, &AddressEntry::code);
    lanes[at->register_] |= 1u << at->lane;
  }
  return lanes;
}

Lanes lanes_written(const Operation& operation) {
  Lanes lanes;
  if (operation.op != nullptr && is_arithmetic(*operation.op)) {
    lanes[operation.target] |= operation.mask;
    if (operation.modifier == kModifierRcp || operation.modifier == kModifierRsq) lanes[kRegisterS] |= operation.mask;
  }
  if (operation.op != nullptr && operation.op->code == kOpTexload) lanes[operation.target] = kEveryLane;
  if ((operation.op != nullptr && operation.op->code == kOpTexload4x) || operation.second == kSecondLoad4x) {
    for (std::uint32_t i = 0; i < 4; ++i) lanes[kRegisterI0 + i] = kEveryLane;
  }
  if (operation.second == kSecondLoad) lanes[kRegisterI0 + decode_load(operation.payload).result] = kEveryLane;
  return lanes;
}

/// The first register that both touch, as text with its components; empty: none.
std::string shared(const Lanes& a, const Lanes& b) {
  for (const auto& [code, lanes] : a) {
    const auto other = b.find(code);
    const std::uint32_t both = other == b.end() ? 0 : lanes & other->second;
    if (both == 0) continue;
    std::string text = std::string(register_of(code)->name) + ".";
    for (std::uint32_t c = 0; c < 4; ++c)
      if (both >> c & 1) text += kLanes[c];
    return text;
  }
  return "";
}

class Parser {
 public:
  Parser(std::string_view text, std::string_view file) : file_(file), tokens_(tokens_of(text, file)) {}

  Assembled run() {
    while (peek().kind != TokenKind::kEnd) statement();
    for (const auto& [word, place] : jumps_) {
      const auto at = result_.labels.find(place.label);
      if (at == result_.labels.end()) fail(place.token, "expected a label of the program, found '" + place.label + "'");
      Instruction instruction = decode(result_.words[word]);
      static_assert(kJumpPlaceAt == 0 && kCallPlaceAt == 0);
      instruction.payload |= at->second;
      result_.words[word] = encode(instruction);
    }
    return std::move(result_);
  }

 private:
  // ---- tokens
  const Token& peek(std::size_t ahead = 0) const { return tokens_[std::min(at_ + ahead, tokens_.size() - 1)]; }
  const Token& take() {
    const Token& token = peek();
    if (at_ + 1 < tokens_.size()) ++at_;
    return token;
  }
  bool accept(std::string_view symbol) {
    if (!peek().is(symbol)) return false;
    take();
    return true;
  }
  /// The point before components stands in the line of its register; one that begins a line is a directive's.
  bool accept_point() { return at_ > 0 && tokens_[at_ - 1].line == peek().line && accept("."); }
  bool accept_word(std::string_view word) {
    if (!peek().word(word)) return false;
    take();
    return true;
  }
  [[noreturn]] void fail(const Token& token, const std::string& what) const {
    throw AssemblyError(file_, token.line, token.column, what);
  }
  [[noreturn]] void expected(const std::string& what) const {
    const Token& token = peek();
    std::string found(token.text.substr(0, 40));
    fail(token, "expected " + what + ", found " +
                    (token.kind == TokenKind::kEnd ? "the end of the program" : "'" + found + "'"));
  }
  void expect(std::string_view symbol, const std::string& why) {
    if (!accept(symbol)) expected("'" + std::string(symbol) + "' " + why);
  }
  void note(const Token& token, std::string text) {
    result_.notes.push_back({token.line, token.column, std::move(text)});
  }

  double number(const Token& token) const {
    double value = 0;
    const char* const begin = token.text.data();
    const char* const end = begin + token.text.size();
    const auto [stop, status] = std::from_chars(begin, end, value);
    if (stop != end || status != std::errc()) fail(token, "expected a number, found '" + std::string(token.text) + "'");
    return value;
  }
  std::uint32_t integer(const std::string& what, std::uint32_t most) {
    const std::string range = what + " from 0 to " + std::to_string(most);
    accept("+");
    if (peek().kind != TokenKind::kNumber) expected(range);
    const double value = number(peek());
    if (!(value >= 0 && value <= most) || value != std::floor(value)) expected(range);
    take();
    return static_cast<std::uint32_t>(value);
  }

  // ---- statements
  void statement() {
    if (label()) return;
    if (peek().word("par")) {
      const Token par = take();
      expect("(", "after 'par'");
      std::vector<Operation> before;
      while (!accept(")")) {
        if (peek().kind == TokenKind::kEnd) expected("')' of the par in line " + std::to_string(par.line));
        if (peek().word("par")) expected("an instruction: a par holds no other");
        if (!label()) instruction(&before);
      }
      return;
    }
    instruction(nullptr);
  }

  bool label() {
    const Token& token = peek();
    if ((token.kind != TokenKind::kWord && token.kind != TokenKind::kNumber) || !peek(1).is(":")) return false;
    if (!result_.labels.emplace(token.text, static_cast<std::uint32_t>(result_.words.size())).second)
      fail(token, "expected a label that the program does not have yet, found '" + std::string(token.text) + "'");
    take();
    take();
    return true;
  }

  /// An instruction of one operation or two; `before`: what a par has done so far.
  void instruction(std::vector<Operation>* before) {
    if (peek().is(".") && peek(1).word("word")) return word();
    std::vector<Operation> made = operation();
    if (peek().is("+")) {
      const Token plus = take();
      if (made.size() > 1) fail(plus, "expected the end of an instruction that takes two words, found '+'");
      std::vector<Operation> other = operation();
      if (other.size() > 1) fail(plus, "expected an instruction of one word after '+'");
      check_par(before, made[0]);
      check_par(before, other[0]);
      pair(made[0], other[0]);
      return;
    }
    for (const Operation& each : made) {
      check_par(before, each);
      if (each.op != nullptr) {
        emit(&each, nullptr);
      } else {
        emit(nullptr, &each);
      }
    }
  }

  void word() {
    take();
    take();
    const Token& token = peek();
    std::string_view digits = token.text;
    if (token.kind != TokenKind::kNumber || digits.substr(0, 2) != "0x" || digits.size() > 2 + (kWordBits + 3) / 4)
      expected("0x and up to 27 hexadecimal digits");
    digits.remove_prefix(2);
    Word value{};
    for (const char digit : digits) {
      const auto at = std::string_view("0123456789abcdef").find(digit);
      if (at == std::string_view::npos) expected("0x and up to 27 hexadecimal digits, in lower case");
      value[1] = value[1] << 4 | value[0] >> 60;
      value[0] = value[0] << 4 | at;
    }
    if (digits.empty()) expected("0x and up to 27 hexadecimal digits");
    push(value, take().line);
  }

  void check_par(std::vector<Operation>* before, const Operation& operation) {
    if (before == nullptr) return;
    for (const Operation& earlier : *before) {
      const std::string read = shared(lanes_written(earlier), lanes_read(operation));
      if (!read.empty())
        note(operation.token, "hazard in a par: " + read + " is written in line " + std::to_string(earlier.token.line) +
                                  "; instructions are executed in order, so the new value is read");
      const std::string written = shared(lanes_written(earlier), lanes_written(operation));
      if (!written.empty())
        note(operation.token, "hazard in a par: " + written + " is written in line " +
                                  std::to_string(earlier.token.line) + " too; this line is the later one");
    }
    before->push_back(operation);
  }

  // ---- operations
  /// One operation; two, where a spelling takes two words.
  std::vector<Operation> operation() {
    const Token token = peek();
    if (token.kind != TokenKind::kWord) expected("an instruction");
    if (token.word("if")) {
      take();
      Operation condition;
      parse_condition(condition);
      accept_word("then");
      if (!is_secondary(peek())) expected("jmp, call, trace, return or exit after the condition");
      std::vector<Operation> made = operation();
      if (made.size() != 1 || made[0].op != nullptr || made[0].conditional())
        fail(token, "expected one condition for the instruction");
      made[0].classes = condition.classes;
      made[0].lanes = condition.lanes;
      made[0].all = condition.all;
      return made;
    }
    if (is_secondary(token)) return {secondary()};
    std::string_view name = token.text;
    std::uint32_t modifier = kModifierNone, component = 4;
    const std::size_t underscore = name.find('_');
    if (const auto* spelling = find_spelling(name); spelling != nullptr) {
      name = spelling->means;
      if (!spelling->note.empty())
        note(token, "'" + std::string(token.text) + "' is " + std::string(name) + ": " + std::string(spelling->note));
    } else if (underscore != std::string_view::npos) {
      std::string_view suffix = name.substr(underscore + 1);
      name = name.substr(0, underscore);
      if (const auto* spelling_of = find_spelling(name); spelling_of != nullptr) name = spelling_of->means;
      if (suffix.size() == 4 && (suffix.starts_with("rcp") || suffix.starts_with("rsq"))) {
        component = static_cast<std::uint32_t>(kLanes.find(suffix[3]));
        if (component > 3) expected("a component x, y, z or w after the suffix");
        suffix.remove_suffix(1);
      }
      const auto at = std::ranges::find(kModifierTable, suffix, &ModifierEntry::name);
      if (at == kModifierTable.end() || suffix.empty()) expected("one of the suffixes _sat, _rcp, _rsq");
      modifier = at->code;
    }
    if (name == "load" || name == "load4x") {
      if (modifier != kModifierNone) expected("an instruction without a suffix");
      take();
      return load(token, name == "load4x");
    }
    const OpEntry* const op = find_op(name);
    if (op == nullptr) expected("an instruction");
    if (modifier != kModifierNone && !is_arithmetic(*op)) expected("an instruction without a suffix");
    take();
    Operation made;
    made.token = token;
    made.op = op;
    made.modifier = modifier;
    switch (op->kind) {
      case OpKind::None:
        return {made};
      case OpKind::Store: {
        LoadPayload payload;
        payload.address = address();
        expect(",", "before the offset");
        payload.offset = integer("an offset", (1u << kLoadOffsetBits) - 1);
        made.second = kSecondStore;
        made.payload = encode(payload);
        sources(made, false);
        return {made};
      }
      case OpKind::Texture:
        if (op->code == kOpTexload || (op->code == kOpTexload4x && is_result(peek()) && is_operand_list_of(3))) {
          made.target = result();
          if (op->code == kOpTexload4x && made.target != kRegisterI0)
            fail(peek(), "expected I0: four texels go to I0 to I3");
          if (op->code == kOpTexload4x) made.target = 0;
          expect(",", "before the texture");
        }
        sources(made, true);
        return {made};
      case OpKind::Trace:
        sources(made, true);
        return {made};
      default:
        break;
    }
    if (accept_point()) {  // dp3_rcp.z
      const auto lane = peek().text.size() == 1 ? kLanes.find(peek().text[0]) : std::string_view::npos;
      if ((modifier != kModifierRcp && modifier != kModifierRsq) || component != 4 || lane == std::string_view::npos)
        expected("a component x, y, z or w of _rcp or _rsq");
      component = static_cast<std::uint32_t>(lane);
      take();
    }
    target(made);
    if (modifier == kModifierRcp || modifier == kModifierRsq)
      made.component = component < 4 ? component : static_cast<std::uint32_t>(std::bit_width(made.mask)) - 1;
    sources(made, false);
    return {made};
  }

  static const SpellingEntry* find_spelling(std::string_view name) {
    const auto at = std::ranges::find(kSpellings, name, &SpellingEntry::name);
    return at == kSpellings.end() ? nullptr : &*at;
  }
  bool is_secondary(const Token& token) const {
    if (token.word("trace")) return peek(1).word("push") || peek(1).word("rty");
    return token.word("jmp") || token.word("call") || token.word("return") || token.word("exit") || token.word("if");
  }
  static bool is_result(const Token& token) {
    return token.text.size() == 2 && token.text[0] == 'I' && token.text[1] >= '0' && token.text[1] <= '3';
  }
  /// Whether what follows is a list of that many operands, none of which is a number with a fraction sign in the way.
  bool is_operand_list_of(std::size_t count) const {
    std::size_t commas = 0;
    for (std::size_t ahead = 0;; ++ahead) {
      const Token& token = peek(ahead);
      if (token.is(",")) {
        ++commas;
      } else if (token.kind == TokenKind::kEnd || token.is(")") || token.is(":")) {
        break;
      } else if (ahead > 0 && token.kind == TokenKind::kWord && !peek(ahead - 1).is(",") && !peek(ahead - 1).is(".") &&
                 !peek(ahead - 1).is("-") && !peek(ahead - 1).is("*")) {
        break;
      }
    }
    return commas + 1 == count;
  }

  std::vector<Operation> load(const Token& token, bool four) {
    Operation made;
    made.token = token;
    made.second = four ? kSecondLoad4x : kSecondLoad;
    LoadPayload payload;
    std::optional<Operation> move;
    const Token first = peek();
    if (!four && !is_operand_list_of(3)) {
      note(first, "load without a register goes to I0");
    } else if (is_result(first) && is_operand_list_of(3)) {
      payload.result = result() - kRegisterI0;
      if (four && payload.result != 0) fail(first, "expected I0: four vectors go to I0 to I3");
      expect(",", "before the address");
    } else if (!four) {
      move.emplace();
      move->token = token;
      move->op = find_op("mov");
      target(*move);
      move->sources.push_back({.swizzle = kIdentity, .index = kRegisterI0});
      note(first, "the vector goes to I0 and from there to '" + std::string(first.text) + "': two words");
      expect(",", "before the address");
    }
    payload.address = address();
    expect(",", "before the offset");
    payload.offset = integer("an offset", (1u << kLoadOffsetBits) - 1);
    made.payload = encode(payload);
    if (move) return {made, *move};
    return {made};
  }

  Operation secondary() {
    Operation made;
    made.token = take();
    const std::string_view name = made.token.text;
    if (name == "jmp") {
      made.second = kSecondJmp;
      made.place = place();
      accept(",");
      if (is_condition()) parse_condition(made);
    } else if (name == "return") {
      made.second = kSecondReturn;
      accept(",");
      if (is_condition()) parse_condition(made);
    } else if (name == "exit") {
      made.second = kSecondExit;
      if (peek().kind == TokenKind::kNumber && !peek(1).is(":")) {
        made.payload = encode(ExitPayload{integer("a code", (1u << kExitCodeBits) - 1)});
      }
      accept(",");
      if (is_condition()) parse_condition(made);
    } else if (name == "trace") {
      made.second = kSecondTrace;
      TracePayload payload;
      push_and_entry(payload.push, payload.entry);
      made.payload = encode(payload);
      if (is_condition()) parse_condition(made);
    } else if (peek().word("HIT") || peek().word("push") || peek().word("rty")) {
      made.second = kSecondMaterial;
      if (accept_word("HIT")) {
        expect(".", "of HIT.w");
        if (!accept_word("w")) expected("w of HIT.w, the component that names the material");
      } else {
        note(made.token, "a call without a place is a call of the material, HIT.w");
      }
      MaterialPayload payload;
      push_and_entry(payload.push, payload.entry);
      made.payload = encode(payload);
      if (is_condition()) parse_condition(made);
    } else {
      made.second = kSecondCall;
      made.place = place();
      CallPayload payload;
      std::uint32_t entry = 0;
      const Token at = peek();
      push_and_entry(payload.push, entry);
      if (entry != 0) note(at, "rty means nothing in a call of a place");
      made.payload = encode(payload);
      if (is_condition()) parse_condition(made);
    }
    return made;
  }

  Place place() {
    const Token& token = peek();
    if (token.kind != TokenKind::kWord && token.kind != TokenKind::kNumber) expected("a label");
    if (token.word("push") || token.word("rty") || token.word("or") || token.word("and")) expected("a label");
    take();
    return {std::string(token.text), token};
  }
  void push_and_entry(std::uint32_t& push, std::uint32_t& entry) {
    accept(",");
    if (accept_word("push")) push = integer("a number of registers", (1u << kCallPushBits) - 1);
    if (accept_word("rty")) entry = integer("a kind of ray", (1u << kTraceEntryBits) - 1);
    accept(",");
  }

  // ---- conditions
  static bool is_lanes(const Token& token) {
    return token.kind == TokenKind::kWord && token.text.find_first_not_of(kLanes) == std::string_view::npos;
  }
  bool is_compare(const Token& token) const {
    return token.is("<") || token.is(">=") || token.is(">") || token.is("<=") || token.is("=") || token.is("==") ||
           token.is("!=");
  }
  bool is_condition() const {
    if (peek().word("or") || peek().word("and")) return true;
    return is_lanes(peek()) && (is_compare(peek(1)) || peek(1).is("("));
  }
  void parse_condition(Operation& made) {
    bool several = false;
    made.all = 0;
    if (accept_word("and")) {
      made.all = several = true;
    } else if (accept_word("or")) {
      several = true;
    }
    if (!is_lanes(peek())) expected("components of x, y, z, w");
    made.lanes = 0;
    for (const char c : peek().text) made.lanes |= 1u << kLanes.find(c);
    if (!several && std::popcount(made.lanes) > 1) expected("'and' or 'or' before several components");
    take();
    const bool parentheses = accept("(");
    made.classes = compare();
    for (;;) {
      const bool both = peek().word("and");
      if ((!both && !peek().word("or")) || !is_compare(peek(1))) break;
      take();
      const std::uint32_t other = compare();
      made.classes = both ? made.classes & other : made.classes | other;
    }
    if (parentheses) expect(")", "after the condition");
  }
  std::uint32_t compare() {
    const Token sign = peek();
    if (!is_compare(sign)) expected("a comparison such as <0, >=0, <1, >=1, =0");
    take();
    accept("+");
    const Token& token = peek();
    if (token.kind != TokenKind::kNumber) expected("0 or 1");
    const double value = number(token);
    constexpr std::uint32_t kNegative = 1 << kClassNegative, kZero = 1 << kClassZero, kFraction = 1 << kClassFraction,
                            kOneUp = 1 << kClassOneUp;
    std::uint32_t classes = 0;
    if (value == 0) {
      if (sign.is("<")) classes = kNegative;
      if (sign.is(">=")) classes = kZero | kFraction | kOneUp;
      if (sign.is("<=")) classes = kNegative | kZero;
      if (sign.is(">")) classes = kFraction | kOneUp;
      if (sign.is("=") || sign.is("==")) classes = kZero;
      if (sign.is("!=")) classes = kNegative | kFraction | kOneUp;
    } else if (value == 1) {
      if (sign.is("<")) classes = kNegative | kZero | kFraction;
      if (sign.is(">=")) classes = kOneUp;
      if (classes == 0) fail(sign, "expected < or >= before 1, found '" + std::string(sign.text) + "'");
    } else {
      expected("0 or 1: conditions compare with nothing else");
    }
    take();
    return classes;
  }

  // ---- operands
  std::uint32_t result() {
    if (!is_result(peek())) expected("one of I0, I1, I2, I3");
    const auto code = kRegisterI0 + static_cast<std::uint32_t>(peek().text[1] - '0');
    take();
    return code;
  }

  /// A register by its name, and the component that an alias means, or -1.
  std::pair<std::uint32_t, int> register_name(const std::string& what) {
    const Token& token = peek();
    if (token.kind == TokenKind::kWord) {
      if (const auto at = std::ranges::find(kRegisterTable, token.text, &RegisterEntry::name);
          at != kRegisterTable.end()) {
        take();
        return {at->code, -1};
      }
      if (const auto at = std::ranges::find(kAliases, token.text, &AliasEntry::name); at != kAliases.end()) {
        if (!at->note.empty()) note(token, "'" + std::string(token.text) + "': " + std::string(at->note));
        take();
        return {at->register_, at->lane};
      }
    }
    expected(what);
  }

  std::uint32_t address() {
    const std::string what = "an address A0 to A3, A.x to A.w, TRI, OBJ, PRETRI or PREOBJ";
    const Token token = peek();
    auto [code, lane] = register_name(what);
    if (lane < 0 && accept_point()) {
      const auto at = peek().text.size() == 1 ? kLanes.find(peek().text[0]) : std::string_view::npos;
      if (at == std::string_view::npos) expected("one component x, y, z or w of the address");
      lane = static_cast<int>(at);
      take();
    }
    for (const AddressEntry& entry : kAddressTable)
      if (entry.register_ == code && entry.lane == lane) return entry.code;
    fail(token, "expected " + what + ", found '" + std::string(token.text) + "'");
  }

  void target(Operation& made) {
    const Token token = peek();
    const auto [code, lane] = register_name("a register that can be written");
    if (!register_of(code)->writable)
      fail(token, "expected a register that can be written, found '" + std::string(token.text) + "'");
    made.target = code;
    made.mask = kEveryLane;
    if (lane >= 0) {
      made.mask = 1u << lane;
      return;
    }
    if (!accept_point()) return;
    if (!is_lanes(peek())) expected("components of x, y, z, w");
    made.mask = 0;
    for (const char c : peek().text) made.mask |= 1u << kLanes.find(c);
    take();
  }

  void sources(Operation& made, bool first) {
    for (std::uint32_t i = 0; i < made.op->sources; ++i) {
      if (!first || i > 0)
        expect(",", "before source " + std::to_string(i + 1) + " of " + std::to_string(made.op->sources) + " of " +
                        std::string(made.op->name));
      made.sources.push_back(source());
    }
    if (peek().is(",")) expected("the end of " + std::string(made.op->name) + ", which has no more sources");
  }

  Source source() {
    Source made;
    if (accept("-")) {
      made.negate = 1;
    } else {
      accept("+");
    }
    if (peek().kind == TokenKind::kNumber) {
      const Token token = take();
      const double value = number(token);
      if (accept("*")) {
        if (value != 0.5 && value != 1 && value != 2 && value != 4)
          fail(token, "expected a factor of 0.5, 1, 2 or 4, found '" + std::string(token.text) + "'");
        made.scale = value == 0.5 ? 3 : value == 1 ? 0 : value == 2 ? 1 : 2;
      } else {
        return immediate(token, made.negate != 0 ? -value : value);
      }
    }
    const auto [code, lane] = register_name("a register or a number");
    made.index = code;
    made.swizzle = kIdentity;
    if (lane >= 0) made.swizzle = 0x55u * static_cast<std::uint32_t>(lane);
    if (lane < 0 && accept_point()) {
      const std::string_view letters = peek().text;
      if (!is_lanes(peek()) || letters.size() > 4) expected("up to four components of x, y, z, w");
      made.swizzle = 0;
      for (std::size_t c = 0; c < 4; ++c)
        made.swizzle |= static_cast<std::uint32_t>(kLanes.find(letters[std::min(c, letters.size() - 1)])) << 2 * c;
      take();
    }
    return made;
  }

  Source immediate(const Token& token, double value) {
    const auto rounded_to_float = static_cast<float>(std::clamp(value, -3.4e38, 3.4e38));
    std::uint32_t bits = std::bit_cast<std::uint32_t>(rounded_to_float);
    constexpr std::uint32_t kHalf = 1u << (kImmediateShift - 1);
    if ((bits & 0x7f800000u) == 0) bits &= 0x80000000u;
    bits += kHalf - 1 + (bits >> kImmediateShift & 1);
    bits >>= kImmediateShift;
    const float given = std::bit_cast<float>(bits << kImmediateShift);
    if (static_cast<double>(given) != value) {
      char text[96];
      std::snprintf(text, sizeof text, "%.9g becomes %.9g: an immediate has 10 bits of fraction", value,
                    static_cast<double>(given));
      note(token, text);
    }
    Source made = decode_source(bits);
    made.immediate = 1;
    return made;
  }

  // ---- words
  void push(const Word& word, int line) {
    if (result_.words.size() == kProgramWords)
      throw AssemblyError(file_, line, 1, "expected at most " + std::to_string(kProgramWords) + " words");
    result_.words.push_back(word);
    result_.lines.push_back(line);
  }

  /// One word of a first operation and a second one, either of which may be absent.
  void emit(const Operation* first, const Operation* second) {
    Instruction made;
    made.classes = kAlways;
    made.lanes = kEveryLane;
    std::vector<Source> all;
    if (first != nullptr) {
      made.op = first->op->code;
      made.modifier = first->modifier;
      made.component = first->component;
      made.target = first->target;
      made.mask = first->mask;
      made.second = first->second;
      made.payload = first->payload;
      all = first->sources;
    }
    if (second != nullptr) {
      if (second->op != nullptr) {
        const auto at = std::ranges::find_if(kSecondTable, [&](const SecondEntry& entry) {
          return entry.layout == Layout::Arithmetic && entry.op == second->op->code;
        });
        made.second = at->code;
        ArithmeticPayload payload;
        payload.target = second->target;
        payload.mask = second->mask;
        payload.saturate = second->modifier == kModifierSat;
        made.payload = encode(payload);
        all.insert(all.end(), second->sources.begin(), second->sources.end());
      } else {
        made.second = second->second;
        made.payload = second->payload;
        made.classes = second->classes;
        made.lanes = second->lanes;
        made.all = second->all;
        if (second->place) jumps_.emplace_back(result_.words.size(), *second->place);
      }
    }
    all.resize(kSlotsOfSources);
    made.a = all[0];
    made.b = all[1];
    made.c = all[2];
    push(encode(made), first != nullptr ? first->token.line : second->token.line);
  }

  static bool can_be_second(const Operation& operation) {
    if (operation.op == nullptr) return true;
    return operation.op->kind == OpKind::Arithmetic && operation.modifier != kModifierRcp &&
           operation.modifier != kModifierRsq;
  }
  static bool can_be_first(const Operation& operation) {
    return operation.op != nullptr && (is_arithmetic(*operation.op) || operation.op->kind == OpKind::None);
  }
  static bool is_load(const Operation& operation) {
    return operation.second == kSecondLoad || operation.second == kSecondLoad4x;
  }

  void pair(const Operation& a, const Operation& b) {
    if (a.op == nullptr && !is_load(a))
      fail(b.token, "expected nothing after '" + std::string(a.token.text) + "', which ends an instruction, found '" +
                        std::string(b.token.text) + "'");
    const std::string both = shared(lanes_written(a), lanes_written(b));
    if (!both.empty()) fail(b.token, "expected two operations that write different registers: both write " + both);
    const auto fits = [](const Operation& first, const Operation& second) {
      return can_be_first(first) && can_be_second(second) &&
             first.sources.size() + second.sources.size() <= kSlotsOfSources;
    };
    const std::string old = shared(lanes_written(a), lanes_read(b));
    if (fits(a, b)) {
      if (!old.empty()) note(b.token, "hazard in a pair: " + old + " is read as it was before the first operation");
      return emit(&a, &b);
    }
    if (fits(b, a) && !b.conditional() && !a.conditional()) {
      note(a.token, "the two operations are the other way round in the word");
      return emit(&b, &a);
    }
    // Two words. What each reads is as before the pair, so a word must not write what the next one reads.
    const auto alone = [&](const Operation& each) { each.op != nullptr ? emit(&each, nullptr) : emit(nullptr, &each); };
    const std::string why = "the pair takes two words: ";
    const std::string reason =
        !can_be_second(b) && !can_be_second(a) ? "neither can be the second operation" : "more than three sources";
    if (b.op == nullptr && b.conditional() && a.op != nullptr) {
      note(a.token, why + std::string(a.op->name) + " stands alone");
      alone(a);
      return alone(b);
    }
    if (old.empty() || b.op == nullptr) {
      note(b.token, why + reason);
      alone(a);
      return alone(b);
    }
    if (shared(lanes_written(b), lanes_read(a)).empty()) {
      note(b.token, why + reason + "; the second comes first, because it reads " + old);
      alone(b);
      return alone(a);
    }
    fail(b.token, "expected a pair that fits one word: each reads what the other writes, and there are " + reason);
  }

  std::string_view file_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  Assembled result_;
  std::vector<std::pair<std::size_t, Place>> jumps_;  // words whose payload waits for a label
};

// -------------------------------------------------------------------------------------------------------------------
// text of words

std::string lanes_text(std::uint32_t lanes) {
  std::string text;
  for (std::uint32_t c = 0; c < 4; ++c)
    if (lanes >> c & 1) text += kLanes[c];
  return text;
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  char shorter[40];
  for (int digits = 1; digits < 17; ++digits) {
    std::snprintf(shorter, sizeof shorter, "%.*g", digits, value);
    if (std::strtod(shorter, nullptr) == value) return shorter;
  }
  return text;
}

std::string source_text(const Source& source) {
  if (source.immediate) {
    return number_text(
        static_cast<double>(std::bit_cast<float>((encode(source) & ((1u << (kABits - 1)) - 1)) << kImmediateShift)));
  }
  const RegisterEntry* const entry = register_of(source.index);
  if (entry == nullptr) return "?";
  std::string text = source.negate ? "-" : "";
  constexpr std::array<std::string_view, 4> kScales{"", "2*", "4*", "0.5*"};
  text += kScales[source.scale];
  text += entry->name;
  if (source.swizzle == kIdentity) return text;
  std::string letters;
  for (std::uint32_t c = 0; c < 4; ++c) letters += kLanes[source.swizzle >> 2 * c & 3];
  while (letters.size() > 1 && letters.back() == letters[letters.size() - 2]) letters.pop_back();
  return text + "." + letters;
}

std::string target_text(std::uint32_t code, std::uint32_t mask) {
  const RegisterEntry* const entry = register_of(code);
  if (entry == nullptr) return "?";
  return std::string(entry->name) + (mask == kEveryLane ? "" : "." + lanes_text(mask));
}

std::string condition_text(const Instruction& instruction) {
  if (instruction.classes == kAlways && instruction.lanes == kEveryLane && instruction.all == 0) return "";
  constexpr std::array<std::string_view, 16> kSets{"(<0 and >=0)",      "<0",           "=0", "<=0", "(>0 and <1)",
                                                   "(>0 and <1 or <0)", "(>=0 and <1)", "<1", ">=1", "(<0 or >=1)",
                                                   "(=0 or >=1)",       "(<=0 or >=1)", ">0", "!=0", ">=0",
                                                   "(>=0 or <1)"};
  std::string text = instruction.all ? "and " : std::popcount(instruction.lanes) > 1 ? "or " : "";
  return text + lanes_text(instruction.lanes) + " " + std::string(kSets[instruction.classes]);
}

std::string address_text(const LoadPayload& payload) {
  const auto at = std::ranges::find(kAddressTable, payload.address, &AddressEntry::code);
  return std::string(register_of(at->register_)->name) + "." + kLanes[static_cast<std::size_t>(at->lane)] + ", " +
         std::to_string(payload.offset);
}

std::string text_of(const Instruction& in) {
  const OpEntry* const op = op_of(in.op);
  const SecondEntry* const second = second_of(in.second);
  if (op == nullptr || second == nullptr) return "?";
  const std::array<Source, 3> sources{in.a, in.b, in.c};
  std::string text;
  std::uint32_t used = 0;
  const auto take_sources = [&](std::uint32_t count, bool comma) {
    for (std::uint32_t i = 0; i < count && used < kSlotsOfSources; ++i) {
      if (comma || i > 0) text += ", ";
      text += source_text(sources[used++]);
    }
  };
  if (op->kind != OpKind::None || in.second == kSecondNone) {
    text += op->name;
    if (in.modifier != kModifierNone) text += "_" + std::string(kModifierTable[in.modifier].name);
    if (in.modifier == kModifierRcp || in.modifier == kModifierRsq) text += std::string(".") + kLanes[in.component];
  }
  switch (op->kind) {
    case OpKind::Arithmetic:
    case OpKind::Dot:
      text += " " + target_text(in.target, in.mask);
      take_sources(op->sources, true);
      break;
    case OpKind::Store:
      text += " " + address_text(decode_load(in.payload));
      take_sources(op->sources, true);
      return text;
    case OpKind::Texture:
      text += " ";
      if (op->code == kOpTexload) text += target_text(in.target, kEveryLane) + ", ";
      take_sources(op->sources, false);
      break;
    case OpKind::Trace:
      text += " ";
      take_sources(op->sources, false);
      break;
    case OpKind::None:
      break;
  }
  if (in.second == kSecondNone) return text;
  if (op->kind != OpKind::None) text += " + ";
  const auto with_condition = [&](std::string_view comma) {
    const std::string condition = condition_text(in);
    if (!condition.empty()) text += std::string(comma) + condition;
  };
  switch (second->layout) {
    case Layout::Arithmetic: {
      const auto payload = decode_arithmetic(in.payload);
      text +=
          std::string(second->name) + (payload.saturate ? "_sat " : " ") + target_text(payload.target, payload.mask);
      take_sources(op_of(second->op)->sources, true);
      break;
    }
    case Layout::Load: {
      const auto payload = decode_load(in.payload);
      text += second->name;
      text += " ";
      if (in.second == kSecondLoad) text += "I" + std::to_string(payload.result) + ", ";
      text += address_text(payload);
      break;
    }
    case Layout::Jump:
      text += "jmp L" + std::to_string(decode_jump(in.payload).place);
      with_condition(", ");
      break;
    case Layout::Call: {
      const auto payload = decode_call(in.payload);
      text += "call L" + std::to_string(payload.place) + " push " + std::to_string(payload.push);
      with_condition(" ");
      break;
    }
    case Layout::Material: {
      const auto payload = decode_material(in.payload);
      text += "call HIT.w push " + std::to_string(payload.push) + " rty " + std::to_string(payload.entry);
      with_condition(" ");
      break;
    }
    case Layout::Trace: {
      const auto payload = decode_trace(in.payload);
      text += "trace push " + std::to_string(payload.push) + " rty " + std::to_string(payload.entry);
      with_condition(" ");
      break;
    }
    case Layout::Exit:
      text += "exit " + std::to_string(decode_exit(in.payload).code);
      with_condition(", ");
      break;
    case Layout::None:
      text += second->name;
      with_condition(" ");
      break;
  }
  return text;
}

std::string hex(const Word& word) {
  char text[32];
  std::snprintf(text, sizeof text, "%011llx%016llx", static_cast<unsigned long long>(word[1]),
                static_cast<unsigned long long>(word[0]));
  return text;
}

/// The place that the word jumps to.
std::optional<std::uint32_t> place_of(const Instruction& in) {
  if (in.second == kSecondJmp) return decode_jump(in.payload).place;
  if (in.second == kSecondCall) return decode_call(in.payload).place;
  return std::nullopt;
}

}  // namespace

Assembled assemble(std::string_view text, std::string_view file) { return Parser(text, file).run(); }

bool is_valid(const Instruction& in) {
  const OpEntry* const op = op_of(in.op);
  const SecondEntry* const second = second_of(in.second);
  if (op == nullptr || second == nullptr) return false;
  std::uint32_t sources = op->sources;
  if (in.modifier != kModifierNone && !is_arithmetic(*op)) return false;
  if ((op->kind == OpKind::Store) != (in.second == kSecondStore)) return false;
  if (!is_arithmetic(*op) && op->kind != OpKind::None && op->kind != OpKind::Store && in.second != kSecondNone)
    return false;
  const auto writable = [](std::uint32_t code) {
    const RegisterEntry* const entry = register_of(code);
    return entry != nullptr && entry->writable;
  };
  if (is_arithmetic(*op) && !writable(in.target)) return false;
  if (op->code == kOpTexload && (in.target < kRegisterI0 || in.target > kRegisterI3)) return false;
  if (second->layout == Layout::Arithmetic) {
    const auto payload = decode_arithmetic(in.payload);
    if (!writable(payload.target)) return false;
    if (is_arithmetic(*op) && payload.target == in.target && (payload.mask & in.mask) != 0) return false;
    if ((in.modifier == kModifierRcp || in.modifier == kModifierRsq) && payload.target == kRegisterS &&
        (payload.mask & in.mask) != 0)
      return false;
    sources += op_of(second->op)->sources;
  }
  if (sources > kSlotsOfSources) return false;
  const std::array<Source, 3> all{in.a, in.b, in.c};
  for (std::uint32_t i = 0; i < sources; ++i)
    if (!all[i].immediate && register_of(all[i].index) == nullptr) return false;
  return true;
}

std::string disassemble(const Word& word) {
  const Instruction in = decode(word);
  const std::string text = text_of(in);
  // Only text that gives these bits again is the word's text.
  if (text.find('?') == std::string::npos) {
    try {
      // The place is a label, which stands at place 0 here.
      Word expected = word;
      std::string label;
      if (const auto place = place_of(in)) {
        Instruction at_0 = in;
        at_0.payload -= *place;
        expected = encode(at_0);
        label = "L" + std::to_string(*place) + ":";
      }
      const Assembled again = assemble(label + text, "");
      if (again.words.size() == 1 && again.words[0] == expected) return text;
    } catch (const AssemblyError&) {
      // Nothing that the assembler writes: digits.
    }
  }
  return ".word 0x" + hex(word);
}

std::string disassemble(const std::vector<Word>& words) {
  std::vector<bool> is_place(words.size() + 1);
  std::vector<std::string> texts;
  for (const Word& word : words) {
    std::string text = disassemble(word);
    const auto place = place_of(decode(word));
    if (place && text[0] != '.') {
      if (*place > words.size()) {
        text = ".word 0x" + hex(word);
      } else {
        is_place[*place] = true;
      }
    }
    texts.push_back(std::move(text));
  }
  std::string text;
  for (std::size_t i = 0; i <= words.size(); ++i) {
    if (is_place[i]) text += "L" + std::to_string(i) + ":\n";
    if (i < words.size()) text += "\t" + texts[i] + "\n";
  }
  return text;
}

std::string listing(const Assembled& program, std::string_view text) {
  std::vector<std::string_view> lines;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    lines.push_back(line);
    at = end + 1;
  }
  std::string out;
  char head[96];
  std::size_t word = 0;
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const int line = static_cast<int>(l) + 1;
    std::snprintf(head, sizeof head, "%5d  ", line);
    out += head + std::string(lines[l]) + "\n";
    for (; word < program.words.size() && program.lines[word] <= line; ++word) {
      std::snprintf(head, sizeof head, "        %4zu  %s  ", word, hex(program.words[word]).c_str());
      out += head + disassemble(program.words[word]) + "\n";
    }
    for (const Note& note : program.notes)
      if (note.line == line) out += "        note: column " + std::to_string(note.column) + ": " + note.text + "\n";
  }
  out += "\n" + std::to_string(program.words.size()) + " words";
  if (!program.labels.empty()) out += "; labels:";
  for (const auto& [name, place] : program.labels) out += " " + name + "=" + std::to_string(place);
  return out + "\n";
}

std::string to_bytes(const std::vector<Word>& words) {
  std::string bytes;
  for (const Word& word : words)
    for (const std::uint64_t half : word)
      for (int b = 0; b < 8; ++b) bytes += static_cast<char>(half >> 8 * b & 255);
  return bytes;
}

std::vector<Word> from_bytes(std::string_view bytes, std::string_view file) {
  constexpr std::size_t kWordBytes = 16;
  const std::string name(file);
  if (bytes.size() % kWordBytes != 0)
    throw Error(name + ": " + std::to_string(bytes.size()) + " bytes are no program: a word has 16");
  if (bytes.size() / kWordBytes > kProgramWords)
    throw Error(name + ": more than " + std::to_string(kProgramWords) + " words");
  std::vector<Word> words(bytes.size() / kWordBytes);
  for (std::size_t i = 0; i < bytes.size(); ++i)
    words[i / kWordBytes][i % kWordBytes / 8] |= std::uint64_t{static_cast<unsigned char>(bytes[i])} << 8 * (i % 8);
  for (std::size_t i = 0; i < words.size(); ++i)
    if (words[i][1] >> (kWordBits - 64) != 0)
      throw Error(name + ": word " + std::to_string(i) + " has more than " + std::to_string(kWordBits) + " bits");
  return words;
}

}  // namespace retrace::shader
