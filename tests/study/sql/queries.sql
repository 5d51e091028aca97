-- Literals inside aggregates
select sum(1) as s from t
select k, sum(1) as s from t group by k
select sum(1) as s from t where id < 0
select sum(case when true then 1 else 0 end) as s from t
select sum(1.0) / count(*) as m from t
select avg(2) as a, min(3) as b, max(4) as c, median(5) as d from t
select avg(2) as a, min(3) as b, max(4) as c, median(5) as d from t where id < 0
select count(1) as a, count(null) as b, count(2 + 3) as c, count('a') as d from t
select k, count(1 + 1) as a, avg(7.5) as b, max('z') as c from t group by k
select stddev(1) as s, var_samp(2) as v from t
select sum(2 * 3) as s, sum(-1) as m from t
select k, sum(1) filter (where x > 0.5) as s from t group by k
select sum(1) filter (where x > 0.5) as s from t
select k, count(*) as n, sum(1) as s, sum(1) * 1.0 / count(*) as r from t group by k
select sum(cast(true as int)) as s from t
select sum(pi()) as s from t
select sum(coalesce(null, 2)) as s from t
-- Aggregates
select count(*) as a, count(x) as b, count(distinct k) as c, count(distinct x) as d, count(name) as e from t
select sum(x) as s, avg(x) as a, min(x) as lo, max(x) as hi from t
select sum(n) as s, avg(n) as a, min(n) as lo, max(n) as hi from t
select sum(x) as s, avg(x) as a, min(x) as lo, max(x) as hi, count(x) as c, count(*) as r from t where id < 0
select k, sum(x) as s, avg(x) as a, min(x) as lo, max(x) as hi, count(x) as c from t group by k
select stddev(x) as a, stddev_samp(x) as b, var_samp(x) as c, variance(x) as d from t
select stddev_pop(x) as a, var_pop(x) as b from t
select k, stddev(x) as a, stddev_pop(x) as b, var_samp(x) as c, var_pop(x) as d from t group by k
select id, stddev(x) as a, stddev_pop(x) as b, var_pop(x) as c from t group by id
select corr(x, load) as a, covar_samp(x, load) as b, covar_pop(x, load) as c from t
select id, covar_samp(x, load) as a, covar_samp(x, load) filter (where k = 1) as b from t group by id
select covar_samp(x, load) as a from t where id < 0
select k, corr(x, load) as a, covar_samp(x, load) as b, covar_pop(x, load) as c from t group by k
select covar_samp(x, load) / var_samp(load) as slope from t where x is not null
select median(x) as a, quantile_cont(x, 0.25) as b, quantile_cont(x, 0.9) as c, quantile_disc(x, 0.5) as d from t
select k, median(x) as a, quantile_cont(x, 0.1) as b, quantile_cont(x, 1) as c, quantile_disc(x, 0.3) as d from t group by k
select median(n) as a, quantile_cont(n, 0.4) as b, quantile_disc(n, 0.75) as c from t
select percentile_cont(0.25) within group (order by x) as a, percentile_disc(0.5) within group (order by x) as b from t
select k, percentile_cont(0.75) within group (order by load) as a from t group by k
select percentile_cont(0.25) within group (order by x desc) as a from t
select min(name) as a, max(name) as b, count(distinct name) as c from t
select min(flag) as a, max(flag) as b from t
select k, min(name) as a, max(name) as b from t group by k
select sum(x) filter (where k = 1) as a, count(*) filter (where k = 1) as b, avg(x) filter (where k = 7) as c from t
select load, count(*) filter (where x > 0.5) as a, max(x) filter (where n > 0) as b from t group by load
select sum(case when x > 0.5 then 1 else 0 end) as s, sum(case when x > 0.5 then 1 end) as c from t
select avg(case when flag then 1.0 else 0.0 end) as share from t
select sum(x) / sum(load) as r, sum(x * load) / sum(load) as w from t where x is not null
select max(x) - min(x) as span, (max(x) + min(x)) / 2 as mid from t
select sqrt(avg(x * x)) as rms, exp(avg(ln(load))) as g from t
select avg(x) * 2 + count(*) as a, round(avg(x), 3) as b from t
select sum(x + 1) as a, sum(x) + 1 as b, avg(abs(n)) as c from t
select count(distinct k) as a, count(distinct load) as b, count(distinct flag) as c from t where x > 0.3
select string_agg(name, ',' order by id) as s from t
select k, string_agg(name, '|' order by id) as s from t group by k
select bool_and(flag) as a, bool_or(flag) as b from t
select min(load), max(load) from t
select count(*) from t
select sum(load), avg(load), min(load), max(load), count(load), count(*) from t
select k, min(load), max(load) from t group by k
select max(load) from t
select min(load) as load, max(load) as x from t
-- Groups
select k, load, count(*) as n, avg(x) as a from t group by k, load
select k, load, count(*) as n from t group by 1, 2
select k as g, count(*) as n from t group by g
select k + 1 as g, count(*) as n from t group by k + 1
select k + 1 as g, count(*) as n from t group by g
select id % 3 as r, sum(n) as s from t group by id % 3
select round(load, 1) as l, count(*) as n from t group by round(load, 1)
select case when x > 0.5 then 'big' else 'small' end as size, count(*) as n from t group by size
select case when x > 0.5 then 'big' else 'small' end as size, count(*) as n from t group by case when x > 0.5 then 'big' else 'small' end
select k from t group by k
select count(*) as n from t group by k
select distinct k from t
select distinct k, load from t
select distinct k + 1 as g from t where k is not null
select k, avg(x) as m from t group by k having count(*) > 4
select k, avg(x) as m from t group by k having m > 0.5
select k, sum(x) as s from t group by k having k in (select k from u)
select k, sum(x) as s from t group by k having k not in (select k from u where k > 1)
select k, avg(x) as m from t group by k having avg(x) > 0.5 and k is not null
select k, sum(n) as s from t group by k having max(load) > 0.3 and min(id) < 5
select load as l, count(*) as n from t group by load having l < 0.3
select load as l, count(*) as n from t group by l having l < 0.3
select k, count(*) as n from t group by k having k > 1
select count(*) as n from t having count(*) > 5
select count(*) as n from t having count(*) > 500
select k, max(x) as x from t group by k
select k, max(x) as x from t group by k having max(x) > 0.8
select k * 10 as k, count(*) as n from t group by t.k
select k, load, sum(x) as s from t group by all
select flag, count(*) as n, sum(x) as s from t group by flag
select name, count(*) as n from t group by name
select k, avg(m) as mm from (select k, load, avg(x) as m from t group by k, load) as d group by k
select k, avg(x) / (select avg(x) from t) as r from t group by k
select k, count(*) as n from t group by k order by count(*) desc, k
select k, avg(x) as m from t group by k order by avg(x), k
select k, avg(x) as m from t group by k order by max(load) desc, k
select k, avg(x) as m from t group by k order by m desc nulls last limit 2
select k, load, max(n) as m from t group by k, load order by k, load desc
select k, 2 * max(n) as m from t group by k order by 2 * max(n), k
select -k as k, count(*) as n from t group by k order by k
select load, k, avg(x) as a, stddev(x) / sqrt(count(x)) as sem from t group by load, k
select k, 1 as one, 'a' as letter, count(*) as n from t group by k
select k, coalesce(sum(x), 0) as s, nullif(count(x), 0) as c from t group by k
select k, abs(min(n)) + max(n) as a, least(min(x), 0.4) as b, greatest(max(x), 0.9) as c from t group by k
-- Windows
select id, row_number() over (order by id) as r from t
select id, row_number() over (partition by k order by load, id) as r from t
select id, row_number() over (partition by k order by load desc, id) as r from t
select id, row_number() over (order by load desc, id desc) as r from t
select id, rank() over (order by load) as r, dense_rank() over (order by load) as d from t
select id, rank() over (partition by k order by load desc) as r from t
select id, rank() over (order by k, load desc) as r from t
select id, percent_rank() over (order by load) as p, cume_dist() over (order by load) as c from t
select id, ntile(4) over (order by id) as q from t
select id, ntile(5) over (partition by k order by id) as q from t
select id, sum(x) over () as s from t
select sum(x) over () as s from t
select u.*, row_number() over (order by t.id, u.y) as r from t join u on t.k = u.k
select b.*, sum(b.x) over (order by a.id, b.id) as s from t a join t b on a.id = b.id + 1
select * exclude (name, flag), rank() over (order by load) as r from t
select id, median(x) over () as m, quantile_disc(n, 0.25) over (partition by k) as q from t
select id, count(*) over () as n, x / sum(x) over () as share from t
select id, avg(x) over (partition by k) as m, x - avg(x) over (partition by k) as d from t
select id, sum(x) over (partition by k order by load) as s from t
select id, sum(x) over (order by load) as s from t
select id, sum(x) over (order by load, id) as s from t
select id, avg(x) over (partition by k order by load) as m from t
select id, avg(x) over (order by id) as m from t
select id, count(*) over (order by load) as c, count(x) over (order by load) as d from t
select id, count(*) over (partition by k order by load) as c from t
select id, min(x) over (order by load) as lo, max(x) over (order by load) as hi from t
select id, min(x) over (partition by k) as lo, max(n) over (partition by k) as hi from t
select id, sum(1) over (partition by k) as n, sum(1) over () as m from t
select id, sum(n) over (order by id) as s, sum(n) over (order by id desc) as back from t
select id, sum(n) over (order by id rows unbounded preceding) as s from t
select id, sum(x) over (order by load, id rows between unbounded preceding and current row) as s from t
select id, avg(x) over (order by id rows between 1 preceding and 1 following) as m from t
select id, avg(x) over (partition by k order by id rows between 2 preceding and current row) as m from t
select id, sum(n) over (order by id rows between 1 following and 3 following) as s from t
select id, sum(n) over (order by id rows between current row and unbounded following) as s from t
select id, max(x) over (order by id rows between 3 preceding and 1 preceding) as m from t
select id, count(x) over (order by id rows 2 preceding) as c from t
select id, sum(n) over (order by load range between unbounded preceding and current row) as s from t
select id, sum(n) over (order by load range between current row and unbounded following) as s from t
select id, sum(n) over (order by load rows between unbounded preceding and unbounded following) as s from t
select id, lag(x) over (order by id) as p, lead(x) over (order by id) as q from t
select id, lag(x, 2) over (partition by k order by id) as p from t
select id, lag(n, 1, -99) over (partition by k order by id) as p, lead(n, 2, 0) over (order by id) as q from t
select id, x - lag(x) over (partition by k order by load, id) as d from t
select id, lag(name) over (order by id) as p, lead(flag) over (order by id) as q from t
select id, first_value(x) over (partition by k order by id) as f, last_value(x) over (partition by k order by id) as l from t
select id, first_value(name) over (order by load, id) as f from t
select id, last_value(n) over (order by id rows between unbounded preceding and unbounded following) as l from t
select id, nth_value(n, 2) over (partition by k order by id) as v from t
select id, stddev(x) over (partition by k) as s, var_pop(x) over (order by id) as v from t
select id, median(x) over (partition by k) as m, quantile_cont(x, 0.25) over (partition by k) as q from t
select id, sum(x) filter (where n > 0) over (partition by k) as s from t
select id, count(*) filter (where x > 0.5) over (order by id) as c from t
select id, sum(x) over w as s, avg(x) over w as a from t window w as (partition by k order by load)
select id, sum(case when x > 0.5 then 1 else 0 end) over (partition by k order by id) as s from t
select id, round(sum(x) over (partition by k order by id), 2) as s from t
select id, sum(x) over (partition by k order by load) / sum(x) over (partition by k) as share from t
select id, sum(x * load) over (partition by k, flag) as s from t
select id, rank() over (partition by k order by x desc nulls last) as r from t
select id, rank() over (order by x nulls first) as r from t
select id, row_number() over (order by x, id) as r from t
select id, row_number() over (order by name, id) as r from t
select id, row_number() over (order by flag desc, id) as r from t
select k, load, avg(x) as a, sum(avg(x)) over (partition by k order by load) as s from t group by k, load
select k, count(*) as n, count(*) * 1.0 / sum(count(*)) over () as share from t group by k
select k, rank() over (order by avg(x) desc) as r from t group by k
select k, load, rank() over (partition by k order by load) as r from t group by k, load
select load, avg(x) as a, lag(avg(x)) over (order by load) as p from t group by load
select * from (select id, k, row_number() over (partition by k order by load, id) as r from t) as d where r = 1
select id, k from t qualify row_number() over (partition by k order by load, id) = 1
select id, rank() over (order by load) as r from t qualify r <= 3
select id, sum(x) over (order by id) as s from t order by s desc nulls last, id
select id from t order by row_number() over (order by load desc, id)
select id, sum(x) over (order by id) as s from t where k = 1
select * from (select id, sum(n) over () as s from t) as d where id > 20
select distinct k, count(*) over (partition by k) as c from t
select id, row_number() over () > 0 as b from t
select t.id, sum(u.y) over (partition by t.k order by t.id, u.y) as s from t join u on t.k = u.k
select *, count(*) over (partition by k) as c from u
select id, sum(x) over (partition by k order by load) as s from t where id < 0
select id, (id - avg(id) over ()) / stddev(id) over () as z from t
select id, sum(load) over (partition by id % 2, k is null order by id) as s from t
-- Nulls and conditions
select id from t where x is null
select id from t where x is not null and k is null
select id from t where not (x > 0.5)
select id from t where x > 0.5 or n > 0
select id from t where x <> 0.5
select id from t where k in (1, 2)
select id from t where k not in (1, 2)
select id from t where load in (0.1, 1)
select id from t where k in (1, null)
select id from t where k not in (1, null)
select id from t where x between 0.2 and 0.6
select id from t where x not between 0.2 and 0.6
select id from t where n between -2 and 2
select id, x is null as a, coalesce(x, 0) as b, coalesce(k, n, 0) as c from t
select id, nullif(k, 1) as a, ifnull(x, -1) as b from t
select id, flag is true as a, flag is not true as b, flag is false as c, flag is not false as d from t
select id, not flag as a, flag and x > 0.5 as b, flag or x > 0.5 as c from t
select id, x is distinct from load as a, k is not distinct from n as b from t
select id, case when x > 0.6 then 'high' when x > 0.3 then 'mid' when x is null then 'none' else 'low' end as c from t
select id, case k when 1 then 10 when 2 then 20 end as c from t
select id, case when k = 1 then x end as c from t
select id, k = null as a, null = null as b from t
select id, greatest(x, load) as a, least(x, load, 0.25) as b from t
select id from t where flag
select id from t where not flag
select id from t where name like 'a%'
select id from t where name not like '%e%'
select id from t where name ilike 'B%'
select id from t where name like '_e%'
select id from t where name in ('alpha', 'beta')
select id from t where name is null or name = ''
select sum(x) as s from t where x > (select avg(x) from t)
select id from t where load = (select max(load) from t)
select id, x - (select avg(x) from t) as d from t
select id from t where k in (select k from u where y > 2)
select id from t where k not in (select k from u where k is not null)
select id from t where k not in (select k from u)
select id from t where exists (select 1 from u where y > 100)
-- Arithmetic, rounding and casts
select id, n + 1 as a, n - 2 as b, n * 3 as c, -n as d, +n as e from t
select id, n / 2 as a, n / 4.0 as b, id / 4 as c from t
select id, n // 2 as a, id // 5 as b from t
select id, n % 3 as a, id % 7 as b, mod(n, 4) as c from t
select id, x % 0.3 as a, -x % 0.3 as b from t
select -7 % 3 as a, 7 % -3 as b, -7.5 % 2 as c
select round(2.5) as a, round(3.5) as b, round(-2.5) as c, round(0.5) as d, round(2.4) as e
select id, round(n * 0.5) as a, round(x, 2) as b, round(x, 1) as c, round(load * 10) as d from t
select round(1234.567, 2) as a, round(-0.125, 2) as b, round(1234.567, -2) as c
select cast(2.7 as int) as a, cast(-2.7 as int) as b, cast(2.2 as bigint) as c
select id, cast(x * 10 as int) as a, cast(n as double) / 2 as b, cast(k as varchar) as c from t
select id, cast(flag as int) as a, cast(id > 5 as int) as b from t
select cast('12' as int) as a, cast('1.5' as double) as b
select id, x::int as a, n::double as b from t
select id, floor(x * 10) as a, ceil(x * 10) as b, trunc(x * 10) as c, sign(n) as d, abs(n) as e from t
select id, sqrt(load) as a, exp(x) as b, ln(load) as c, log10(load) as d, log2(load) as e from t
select id, power(load, 2) as a, pow(x, 0.5) as b, power(id, 2) as c, power(2, n) as d from t
select id, sin(x) as a, cos(x) as b, tan(x) as c, atan(x) as d, atan2(x, load) as e from t
select id, degrees(x) as a, radians(x) as b, pi() as c from t
select id, x / nullif(n, 0) as a from t
select id, 1e-3 * n as a, 2.5e2 as b, 1 / 3 as c from t
select id, load * 100 as percent, load * 100 > 15 as big from t
select 1 + 2 * 3 - 4 / 2 as a, (1 + 2) * 3 as b, 2 - -3 as c
-- Text
select id, upper(name) as a, lower(name) as b, length(name) as c from t
select id, name || '!' as a, concat(name, '-', id) as b from t
select id, substr(name, 2, 3) as a, substring(name, 2) as b, left(name, 2) as c, right(name, 2) as d from t
select id, replace(name, 'a', 'A') as a, trim('  x ') as b, strpos(name, 'e') as c, reverse(name) as d from t
select id, starts_with(name, 'a') as a from t
select id, position('e' in name) as a from t
-- Joins
select t.id, u.y from t join u on t.k = u.k
select t.id, u.y from t join u using (k)
select t.id, u.y from t inner join u on t.k = u.k and t.load = u.load
select id, y from t join u using (k, load)
select t.id, t.k, u.k as uk, u.y from t left join u on t.k = u.k
select id, k, y from t left join u using (k)
select t.id, u.k as k, u.y from t right join u on t.k = u.k
select coalesce(t.k, u.k) as k, id, y from t full join u on t.k = u.k
select t.id, u.y from t join u on t.k = u.k and u.y = 2.5
select t.id, u.y from t join u on (t.k = u.k and t.x > u.load) where u.y > 2
select a.id as i, b.y, c.y as z from t a join u b on a.k = b.k and b.y > 1 left join u c on b.load = c.load
select t.id, u.y from t left join (select * from u where y > 2) as u on t.k = u.k
select t.id, u.y from t left join u on t.k = u.k and t.load = u.load
select load, sum(1) as n from t natural join u group by load
select t.id, t.k as a, u.k as b, u.y from t full outer join u on t.k = u.k
select t.id, u.y from t left join u on t.k = u.k where u.y is null
select a.id as i, b.id as j from t a join t b on a.load = b.load and a.id < b.id
select a.id as i, b.id as j from t a join t b on a.load < b.load where a.k = 1 and b.k = 2
select t.id, u.y from t, u where t.k = u.k
select t.id, u.y from t, u where t.k = u.k and u.y > 2 and t.x > 0.4
select t.id, u.y from t cross join u where t.id < 3
select count(*) as n from t cross join u
select t.k, count(*) as n, sum(u.y) as s from t join u on t.k = u.k group by t.k
select t.k, avg(t.x) as x, avg(u.y) as y from t left join u on t.k = u.k group by t.k
select a.id, b.m from t a join (select k, avg(x) as m from t group by k) b on a.k = b.k
select a.id, a.x - b.m as d from t a join (select k, avg(x) as m from t group by k) b using (k)
select t.id, u.y, v.y as z from t join u on t.k = u.k join u v on t.k = v.k and t.load = v.load
select t.load, u.load as ul, t.id from t join u on t.k = u.k
select load, id from t join u using (k, load) order by load, id, y
select t.* from t join u on t.k = u.k and t.load = u.load
select * exclude (x), x * 2 as x from t
select * exclude (k), k from t
select count(*) as n from t join u on t.k = u.k
select count(*) as n from t left join u using (k)
select u.k, max(t.x) as m from u left join t on t.k = u.k group by u.k
select t.id, u.y from t join u on t.k + 1 = u.k
select t.id, u.y from t join u on t.k = u.k + 1 and t.load = u.load
select a.id, b.y from t a join u b on abs(a.load - b.load) < 0.05
select a.id, b.y from t a join u b on a.load < b.load and a.k + b.k > 2
select a.id, b.y from t a join u b on a.load = b.load + a.x - a.x
select a.id, b.y from t a join u b on a.k = b.k or a.load = b.load
select a.id, b.y from t a join u b on a.load between b.load - 0.05 and b.load + 0.05
select a.id, b.y, c.y as z from t a join u b on a.k = b.k join u c on c.load > b.load and abs(c.y - a.x) < 2
select a.id, b.y, c.y as z from t a left join u b on a.k = b.k join u c on c.load > a.load and c.y > b.y
select * from t join u using (k)
select * from t left join u using (k, load) order by id, y
select * exclude (x) from t join u using (k)
select *, count(*) over () as c from t join u using (k)
-- Unions and common table expressions
select k from t union select k from u
select k from t union all select k from u
select id, x from t where k = 1 union all select id, x from t where k = 2 order by id
select count(*) as n from (select k from t union all select k from u) as d
select count(*) as n, sum(k) as s from (select k from t union select k from u) as d
select k, count(*) as n from (select k, load from t union all select k, load from u) as d group by k
select 'a' as which, avg(x) as m from t where k = 1 union all select 'b', avg(x) from t where k = 2
select id as i from t where id < 3 union all select k from u order by i
select 1 as a union all select 2 union all select 3
select 1 as a union select 1
select k from t intersect select k from u
select k from t except select k from u
with m as (select k, avg(x) as a from t group by k) select * from m where a > 0.4
with m as (select k, avg(x) as a from t group by k), n as (select max(a) as top from m) select m.k from m, n where m.a = n.top
with m as (select k, avg(x) as a from t group by k) select t.id, t.x - m.a as d from t join m on t.k = m.k
with a as (select * from t where id < 10), b as (select * from a where id > 5) select id, load from b
with a as (select k from t), b as (select k from a union all select k from a) select count(*) as n from b
with m(g, a) as (select k, avg(x) from t group by k) select g, a from m
select d.g, d.m from (select k as g, max(x) as m from t group by k) as d where d.m > 0.5
select avg(m) as a from (select max(x) as m from t group by k) as d
-- Order and limits
select id, load from t order by load, id
select id, load from t order by load desc, id
select id, x from t order by x, id
select id, x from t order by x desc, id
select id, x from t order by x nulls first, id
select id, x from t order by x desc nulls last, id
select id, k, load from t order by k desc, load, id desc limit 5
select id from t order by id limit 5 offset 3
select id from t order by id offset 20
select id, load * 2 as l from t order by l desc, id limit 4
select id, -id as m from t order by m limit 3
select id from t order by load + id limit 6
select -x as x, id from t order by -x, id
select round(x, 1) as x, id from t order by x * load, id
select -id as id from t order by id limit 3
select id, name from t order by name, id
select id, flag from t order by flag, id
select id, load from t order by 2, 1
select id from t order by abs(n), id
select id from t order by case when k = 1 then 0 else 1 end, id
select distinct load from t order by load desc
select distinct k, flag from t order by k, flag
select k from t where id < 8 order by id
select t.load as l from t order by t.load limit 3
select max(x) as m from t order by 1
