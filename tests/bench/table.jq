# From the JSON of all benchmark programs to the rows of scripts/bench. $rows: what to show.
def three: if . >= 100 then round else (. as $x | (if $x >= 10 then 10 elif $x >= 1 then 100 elif $x >= 0.1 then 1000 else 10000 end) as $f | ($x * $f | round) / $f) end;
def median: sort | if length % 2 == 1 then .[length / 2 | floor] else (.[length / 2 - 1] + .[length / 2]) / 2 end;
def seconds: {ns: 1e-9, us: 1e-6, ms: 1e-3, s: 1}[.time_unit];
# All runs of a row in one measure: times in seconds, counters as they are.
def runs($all; $name; $measure):
  [$all[] | select(.run_type != "aggregate" and .name == $name)
   | if $measure == "cpu_time" or $measure == "real_time" then .[$measure] * seconds else .[$measure] end
   | select(. != null)];
def summary($all; $name; $measure):
  runs($all; $name; $measure)
  | if length == 0 then null else {median: median, least: min, most: max, runs: length} end;
def amount($measure):
  if . >= 1e9 then "\(. / 1e9 | three) G" elif . >= 1e6 then "\(. / 1e6 | three) M"
  elif . >= 1e3 then "\(. / 1e3 | three) k" elif . >= 0.1 then "\(three) "
  elif . >= 1e-4 then "\(. * 1e3 | three) m" else "\(. * 1e6 | three) µ" end;
def unit($measure): if $measure == "cpu_time" or $measure == "real_time" then "s" else "/s" end;
def text($measure; $units):
  if . == null then "-"
  else "\(.median | amount($measure))\($units) [\(.least | amount($measure) | rtrimstr(" ")), \(.most | amount($measure) | rtrimstr(" "))]" end;

[inputs.benchmarks[]] as $all
| ($rows[0] | map(. as $row
    | (.measure // "cpu_time") as $measure
    | (.reference_measure // $measure) as $reference_measure
    | (.units // unit($measure)) as $units
    | summary($all; .ours; $measure) as $ours
    | (if .reference then summary($all; .reference; $reference_measure) else null end) as $reference
    | select($ours != null)
    # How many times better than the reference: a rate is better when larger, a time when smaller.
    | (if $reference == null then null
       elif $units == "s" then $reference.median / $ours.median
       else $ours.median / $reference.median end) as $ratio
    | {what, goal, ours: $ours, reference: $reference, ratio: $ratio,
       ours_text: ($ours | text($measure; $units)),
       reference_text: "\(.against // "-")\(if $reference then ": " + ($reference | text($reference_measure; $units)) else "" end)",
       ratio_text: (if $ratio then "\($ratio | three) x" else "-" end)})) as $table
| {commit: $commit, processor: $processor, cores: $cores, repetitions: ([$table[].ours.runs] | max), rows: $table}
