//! Scripts that submit themselves to [Slurm](https://slurm.schedmd.com) as job arrays.

use super::plan::JobPlan;

/// A bash script that submits, renders or merges, as its first argument says.
pub fn script(plan: &JobPlan, name: &str) -> String {
    let (first, end) = plan.frames.unwrap_or((0, 1));
    let (frames, tasks_of_frame) = (u64::from(end - first), u64::from(plan.tiles) * u64::from(plan.ranges));
    let Commands { render, merge } = Commands::new(plan);
    let (name, ranges) = (quoted(name), plan.ranges);
    let last_task = frames * tasks_of_frame - 1;
    let mut text = HEADER.to_owned();
    text += &format!(
        "render)
    frame=$(({first} + SLURM_ARRAY_TASK_ID / {tasks_of_frame}))
    tile=$((SLURM_ARRAY_TASK_ID % {tasks_of_frame} / {ranges} + 1))
    range=$((SLURM_ARRAY_TASK_ID % {ranges} + 1))
    echo \"frame $frame, tile $tile, range $range\"
    \"$alhazen\" {render} || retry
    ;;
"
    );
    if plan.is_divided() {
        text += &format!(
            "merge)
    frame=$(({first} + SLURM_ARRAY_TASK_ID))
    echo \"frame $frame\"
    \"$alhazen\" {merge} || retry
    ;;
"
        );
    }
    text += &format!(
        "*)
    render=$(sbatch --parsable --requeue --job-name={name} --array=0-{last_task} \"$@\" \"$0\" render)
    echo \"render: job $render, {tasks} task(s)\"
",
        tasks = last_task + 1
    );
    if plan.is_divided() {
        text += &format!(
            "    merge=$(sbatch --parsable --requeue --job-name={name} --array=0-{last} \\
        --dependency=\"afterok:${{render%%;*}}\" --kill-on-invalid-dep=yes \"$@\" \"$0\" merge)
    echo \"merge: job $merge, {frames} task(s)\"
",
            last = frames - 1
        );
    }
    text + "    ;;\nesac\n"
}

const HEADER: &str = "#!/usr/bin/env bash
# Renders with Slurm.
#
#     bash THIS-FILE [options of sbatch]
#
# submits an array of render tasks and, where pictures are divided, an array that merges them when all are done. Run it in
# the folder to which file names are relative. ALHAZEN names the program if it is not on the path.
set -euo pipefail
alhazen=${ALHAZEN:-alhazen}

# Slurm itself runs a task again whose machine has died. One that fails goes back to the queue, too, three times.
retry() {
    if [ \"${SLURM_RESTART_COUNT:-0}\" -lt 3 ]; then
        scontrol requeue \"$SLURM_JOB_ID\"
    fi
    exit 1
}

case \"${1:-}\" in
";

/// The arguments of `alhazen`, as bash reads them, with `$frame`, `$tile` and `$range` for what is different.
struct Commands {
    render: String,
    merge: String,
}

impl Commands {
    fn new(plan: &JobPlan) -> Self {
        let folder = plan.folder().to_string_lossy();
        let in_folder =
            |name: &str| if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
        let words = plan.arguments.iter().map(|a| quoted(a));
        let words: Vec<_> =
            ["render".to_owned(), quoted(&plan.scene), "--quiet".into()].into_iter().chain(words).collect();
        let (mut render, mut merge) = (vec![words.join(" ")], vec!["merge --quiet".to_owned()]);
        if plan.frames.is_some() {
            render.push("--frames \"$frame\"".into());
            merge.push("--frame \"$frame\"".into());
        }
        let outputs = plan.output_names().map(|o| format!("--output {}", quoted(&in_folder(&o))));
        if plan.is_divided() {
            render.push(format!("--tile \"$tile/{}\" --sample-range \"$range/{}\"", plan.tiles, plan.ranges));
            // Variables between the quoted pieces of the name.
            let part = in_folder(&plan.part_name("\0tile\0", "\0range\0"));
            let piece = |(i, text): (usize, &str)| {
                if i % 2 == 1 { format!("\"${text}\"") } else { quoted(text) }
            };
            render.push(format!("--output {}", part.split('\0').enumerate().map(piece).collect::<String>()));
            merge.extend(outputs);
            let part =
                |(tile, range): (u32, u32)| in_folder(&plan.part_name(&tile.to_string(), &range.to_string()));
            merge.extend(plan.parts().map(|numbers| quoted(&part(numbers))));
        } else {
            render.extend(outputs);
        }
        let lines = |lines: Vec<String>| lines.join(" \\\n        ");
        Self { render: lines(render), merge: lines(merge) }
    }
}

/// A word for bash that means exactly `text`.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,%+@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_survive_the_shell() {
        assert_eq!(quoted("a/b-1.exr"), "a/b-1.exr");
        assert_eq!(quoted("my scene's $HOME"), r"'my scene'\''s $HOME'");
        assert_eq!(quoted(""), "''");
    }
}
