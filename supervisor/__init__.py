"""The supervisor: releases orders, commits frames, keeps the roster, and starts and shows a run."""
