#include "tools/pmsim/command_line.h"

#include <cmath>
#include <cstdio>
#include <iostream>

#include <CLI/CLI.hpp>

#include "tools/pmsim/text.h"
#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{

Option *Option::required(bool value)
{
    option->required(value);
    return this;
}

Option *Option::one_each()
{
    option->allow_extra_args(false);
    return this;
}

Option *Option::show_default()
{
    option->capture_default_str();
    return this;
}

Option *Option::positive()
{
    option->check([](const std::string &text) {
        double value = 0.0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        return !is_number || (value > 0.0 && std::isfinite(value)) ? std::string()
                                                                   : text + " must be a number above 0";
    });
    return this;
}

Option *Option::range(int low, int high)
{
    option->check(CLI::Range(low, high));
    return this;
}

Option *Option::words(const std::map<std::string, int> &values)
{
    std::vector<std::string> known;
    for (const auto &[word, number] : values) {
        known.push_back(word);
    }
    const auto replace = [values, known](std::string &text) {
        const auto found = values.find(text);
        if (found == values.end()) {
            return "\"" + text + "\" is none of " + join(known, ", ") + did_you_mean(nearest(text, known));
        }
        text = std::to_string(found->second);
        return std::string();
    };
    option->type_name(join(known, "|"))->transform(CLI::Validator(replace, ""));
    return this;
}

Option *Option::needs(const Option *other)
{
    option->needs(other->option);
    return this;
}

Option *Option::excludes(const std::string &name)
{
    option->excludes(name);
    return this;
}

bool Option::empty() const
{
    return option->empty();
}

Command::Command(std::shared_ptr<CLI::App> cli_app) : app(std::move(cli_app))
{
}

Command *Command::add_subcommand(const std::string &name, const std::string &description)
{
    CLI::App *subcommand = app->add_subcommand(name, description);
    commands.push_back(std::make_unique<Command>(app->get_subcommand_ptr(subcommand)));
    return commands.back().get();
}

Option *Command::own(CLI::Option *cli_option)
{
    options.push_back(std::make_unique<Option>(cli_option));
    return options.back().get();
}

Option *Command::add_option(const std::string &name, std::string &variable, const std::string &help)
{
    return own(app->add_option(name, variable, help));
}

Option *Command::add_option(const std::string &name, std::vector<std::string> &variable,
                            const std::string &help)
{
    return own(app->add_option(name, variable, help));
}

Option *Command::add_option(const std::string &name, int &variable, const std::string &help)
{
    return own(app->add_option(name, variable, help));
}

Option *Command::add_option(const std::string &name, uint64_t &variable, const std::string &help)
{
    return own(app->add_option(name, variable, help));
}

Option *Command::add_option(const std::string &name, double &variable, const std::string &help)
{
    return own(app->add_option(name, variable, help));
}

Option *Command::add_flag(const std::string &name, bool &variable, const std::string &help)
{
    return own(app->add_flag(name, variable, help));
}

Option *Command::get_option(const std::string &name)
{
    return own(app->get_option(name));
}

void Command::footer(const std::string &text)
{
    app->footer(text);
}

void Command::callback(const std::function<void()> &run)
{
    app->callback(run);
}

void Command::pass_words(const std::function<void(const std::vector<std::string> &)> &run)
{
    CLI::App *command = app.get();
    command->prefix_command();
    command->set_help_flag();
    command->callback([command, run] { run(command->remaining()); });
}

CommandLine::CommandLine(const std::string &description) : Command(std::make_shared<CLI::App>(description))
{
}

void CommandLine::name(const std::string &text)
{
    app->name(text);
}

void CommandLine::require_subcommand()
{
    app->require_subcommand(1);
}

// CLI11 says "A subcommand is required", whatever stands in its place.
void CommandLine::refuse_unknown_command() const
{
    const std::vector<std::string> words = app->remaining();
    if (app->get_require_subcommand_min() == 0 || !app->get_subcommands().empty() || words.empty()) {
        return;
    }
    if (words.front()[0] == '-') {
        throw InputError("unknown option \"" + words.front() + "\"; --help lists all");
    }
    std::vector<std::string> known;
    for (const CLI::App *command : app->get_subcommands([](const CLI::App *) { return true; })) {
        known.push_back(command->get_name());
    }
    throw InputError(unknown("command", words.front(), known));
}

std::optional<int> CommandLine::parse(int argc, char **argv)
{
    try {
        app->parse(argc, argv);
    } catch (const CLI::RequiredError &error) {
        refuse_unknown_command();
        return app->exit(error) == 0 ? 0 : 2;
    } catch (const CLI::ParseError &error) {
        return app->exit(error) == 0 ? 0 : 2;
    }
    return std::nullopt;
}

int finish(int exit_code)
{
    std::cout.flush();
    const bool is_complete = std::cout.good() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if (!is_complete) {
        std::fprintf(stderr, "pmsim: standard output cannot be written\n");
    }
    return is_complete ? exit_code : 2;
}

} // namespace pmsim
