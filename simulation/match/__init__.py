"""Matches of a deployment between two players' classes: many games in several processes, and what they show."""
