MODULE SpanningLines
  (SYSMODULE,
   NOVIEW)
  PERS robtarget targets{2}:=
  [
  [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],
  [[4,5,6],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]
  ];
  LOCAL
    VAR
      num
        n;
  PROC p(
    num a,
    PERS tooldata t,
    \switch s
  )
    IF a=1 OR
       b=2
    THEN
      x:=f(
        1,
        y:=2);
    ENDIF
    TEST a
      +1

    ! no case yet
    CASE 1,
      2:
      Foo
        a,
        b;
    ENDTEST
    WHILE
      a=1
    DO
    ENDWHILE
  lbl
    :
  ERROR
    (ERR_A)
  ENDPROC
ENDMODULE
