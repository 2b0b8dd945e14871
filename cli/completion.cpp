#include "cli/completion.hpp"

#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace shaker::cli {
namespace {

enum class Wants { nothing, text, file, folder, choice };  // as the next word

struct Word {
  std::vector<std::string> names;  // "--json"; empty for a positional
  std::string help;                // one line
  Wants wants = Wants::nothing;
  std::vector<std::string> choices;
};

struct Command {
  std::string name, help;
  std::vector<Word> options, positionals;
};

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

// From "TEXT:{auto,off,always}".
std::vector<std::string> choices_in(const std::string& type) {
  const auto begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

Word word_of(const CLI::Option& option) {
  Word word;
  for (const std::string& name : option.get_lnames())
    word.names.push_back("--" + name);
  word.help = first_line(option.get_description());
  if (option.get_items_expected_max() == 0) return word;
  const std::string type = option.get_type_name();
  word.choices = choices_in(type);
  word.wants = !word.choices.empty()           ? Wants::choice
               : type.starts_with("FILE")      ? Wants::file
               : type.starts_with(kFolderType) ? Wants::folder
                                               : Wants::text;
  return word;
}

std::vector<Command> commands_of(const CLI::App& app) {
  std::vector<Command> commands;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; })) {
    Command command{each->get_name(), first_line(each->get_description()), {}, {}};
    for (const CLI::Option* option : each->get_options()) {
      if (option->get_positional())
        command.positionals.push_back(word_of(*option));
      else if (!option->get_group().empty())
        command.options.push_back(word_of(*option));
    }
    commands.push_back(std::move(command));
  }
  return commands;
}

// Of the options of one command, those that want `wants`, joined by `separator`.
std::string names_that_want(const Command& command, Wants wants, std::string_view separator) {
  std::vector<std::string> names;
  for (const Word& option : command.options) {
    if (option.wants == wants) names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return fmt::format("{}", fmt::join(names, separator));
}

std::string all_names(const Command& command) {
  std::vector<std::string> names;
  for (const Word& option : command.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return fmt::format("{}", fmt::join(names, " "));
}

// --- bash

// What follows an option, then the options, then what a word is.
std::string bash_command(const Command& command) {
  std::string text = fmt::format("    {})\n      case $previous in\n", command.name);
  const auto row = [&](const std::string& names, const std::string& reply) {
    if (!names.empty()) text += fmt::format("        {}) {} ;;\n", names, reply);
  };
  row(names_that_want(command, Wants::file, " | "), "_shakerctl_reply -f; return");
  row(names_that_want(command, Wants::folder, " | "), "_shakerctl_reply -d; return");
  row(names_that_want(command, Wants::text, " | "), "return");
  for (const Word& option : command.options) {
    if (option.wants == Wants::choice)
      row(fmt::format("{}", fmt::join(option.names, " | ")),
          fmt::format("_shakerctl_reply -W \"{}\"; return", fmt::join(option.choices, " ")));
  }
  text += fmt::format("      esac\n      options=\"{}\"\n", all_names(command));
  for (const Word& word : command.positionals) {
    if (word.wants == Wants::choice)
      text += fmt::format("      words=(-W \"{}\")\n", fmt::join(word.choices, " "));
    if (word.wants == Wants::folder) text += "      words=(-d)\n";
    if (word.wants == Wants::file) text += "      words=(-f)\n";
  }
  return text + "      ;;\n";
}

std::string bash(const std::vector<Command>& commands) {
  std::string text = R"(# Completion of shakerctl for bash, made by `shakerctl completion bash`.
_shakerctl_reply() {
  mapfile -t COMPREPLY < <(compgen "$@" -- "${COMP_WORDS[COMP_CWORD]}")
}
_shakerctl() {
  local previous=${COMP_WORDS[COMP_CWORD - 1]} options="" words=()
  if ((COMP_CWORD == 1)); then
)";
  std::vector<std::string> names;
  for (const Command& command : commands)
    names.push_back(command.name);
  text += fmt::format("    _shakerctl_reply -W \"{} --help --version\"\n    return\n  fi\n",
                      fmt::join(names, " "));
  text += "  case ${COMP_WORDS[1]} in\n";
  for (const Command& command : commands)
    text += bash_command(command);
  return text + R"(  esac
  if [[ ${COMP_WORDS[COMP_CWORD]} == -* ]]; then
    _shakerctl_reply -W "$options"
  elif ((${#words[@]})); then
    _shakerctl_reply "${words[@]}"
  fi
}
complete -o filenames -F _shakerctl shakerctl
)";
}

// --- zsh

// For a string in single quotes; zsh's _arguments takes [ ] and : for itself.
std::string zsh_quoted(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else
      out += std::string(c == '[' || c == ']' || c == ':' || c == '\\' ? "\\" : "") + c;
  }
  return out;
}

std::string zsh_value(const Word& word) {
  switch (word.wants) {
    case Wants::nothing:
      return "";
    case Wants::text:
      return ":value: ";
    case Wants::file:
      return ":file:_files";
    case Wants::folder:
      return ":folder:_files -/";
    case Wants::choice:
      break;
  }
  return fmt::format(":choice:({})", fmt::join(word.choices, " "));
}

std::string zsh(const std::vector<Command>& commands) {
  std::string text = R"(#compdef shakerctl
# Completion of shakerctl for zsh, made by `shakerctl completion zsh`.
_shakerctl() {
  local -a commands=(
)";
  for (const Command& command : commands)
    text += fmt::format("    '{}:{}'\n", command.name, zsh_quoted(command.help));
  text += R"(  )
  if ((CURRENT == 2)); then
    _describe command commands
    return
  fi
  shift words
  ((CURRENT--))
  case $words[1] in
)";
  for (const Command& command : commands) {
    text += fmt::format("    {})\n      _arguments", command.name);
    for (const Word& option : command.options) {
      for (const std::string& name : option.names)
        text += fmt::format(" \\\n        '{}[{}]{}'", name, zsh_quoted(option.help),
                            zsh_value(option));
    }
    for (const Word& word : command.positionals)
      text += fmt::format(" \\\n        '{}'", zsh_value(word));
    text += "\n      ;;\n";
  }
  return text + "  esac\n}\n_shakerctl \"$@\"\n";
}

// --- fish

std::string fish_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text)
    out += std::string(c == '\'' || c == '\\' ? "\\" : "") + c;
  return out + "'";
}

std::string fish_value(const Word& word) {
  switch (word.wants) {
    case Wants::nothing:
      return "";
    case Wants::text:
      return " -x";
    case Wants::file:
      return " -r -F";
    case Wants::folder:
      return " -x -a '(__fish_complete_directories)'";
    case Wants::choice:
      break;
  }
  return fmt::format(" -x -a '{}'", fmt::join(word.choices, " "));
}

std::string fish(const std::vector<Command>& commands) {
  std::string text =
      "# Completion of shakerctl for fish, made by `shakerctl completion fish`.\n"
      "complete -c shakerctl -f\n";
  for (const Command& command : commands) {
    text += fmt::format("complete -c shakerctl -n __fish_use_subcommand -a {} -d {}\n",
                        command.name, fish_quoted(command.help));
    const std::string head =
        fmt::format("complete -c shakerctl -n '__fish_seen_subcommand_from {}'", command.name);
    for (const Word& option : command.options) {
      for (const std::string& name : option.names)
        text += fmt::format("{} -l {}{} -d {}\n", head, name.substr(2), fish_value(option),
                            fish_quoted(option.help));
    }
    for (const Word& word : command.positionals) {
      if (word.wants == Wants::file) text += head + " -F\n";
      if (word.wants == Wants::folder) text += head + " -a '(__fish_complete_directories)'\n";
      if (word.wants == Wants::choice)
        text += fmt::format("{} -a '{}'\n", head, fmt::join(word.choices, " "));
    }
  }
  return text;
}

}  // namespace

void add_completion(CLI::App& app, std::function<int()>& action) {
  auto* command =
      app.add_subcommand("completion", "Print the completion of this command line for a shell");
  const auto* shell = command->add_option("shell")->required()->check(
      CLI::IsMember(std::vector<std::string>{"bash", "zsh", "fish"}));
  command->callback([&app, &action, shell] {
    action = [&app, shell] {
      fmt::print("{}", completion_for(shell->as<std::string>(), app));
      return 0;
    };
  });
}

std::string completion_for(const std::string& shell, const CLI::App& app) {
  const auto commands = commands_of(app);
  if (shell == "bash") return bash(commands);
  if (shell == "zsh") return zsh(commands);
  if (shell == "fish") return fish(commands);
  throw std::invalid_argument(fmt::format("there is no completion for \"{}\"", shell));
}

}  // namespace shaker::cli
